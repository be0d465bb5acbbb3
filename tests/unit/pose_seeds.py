"""Small pose files as each maker writes them, for the tests of slips."""

import json

PLANAR = ((287.5, 103.25, -50.0, 0.0), (296.75, 87.5, -50.0, 90.0), (312.5, 96.75, -50.0, 180.0))
TILTED = (
    (405.8, -62.9, 251.6, 0.0, 0.0, 180.0),
    (444.235, -60.394, 247.269, 40.0, 12.0, -172.0),
    (414.735, -14.437, 245.423, -75.0, -15.0, 170.0),
)
QUATERNIONS = (
    (0.0, 1.0, 0.0, 0.0),
    (0.029526803, -0.934762234, -0.332466138, 0.121712777),
    (0.147710697, 0.776647636, -0.61028196, 0.050556195),
)
VECTORS = (
    (3.141592654, 0.0, 0.0),
    (-2.882689948, -1.025284033, 0.375346999),
    (2.234136663, -1.755562290, 0.145432037),
)


def _each(form, rows=TILTED):
    return "".join(form(number, *row) for number, row in enumerate(rows, start=1))


def _kuka(n, x, y, z, u, v, w):
    return (
        f"DECL E6POS XP{n}={{X {x:.3f},Y {y:.3f},Z {z:.3f},A {u:.3f},B {v:.3f},C {w:.3f},S 2,"
        "T 35}\n"
        f'DECL FDAT FP{n}={{TOOL_NO 0,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " ",TQ_STATE FALSE}}\n'
    )


def _kuka_moves(n, x, y, z, u, v, w):
    return f"LIN {{X {x:.3f},Y {y:.3f},Z {z:.3f},A {u:.3f},B {v:.3f},C {w:.3f}}} C_DIS\n"


def _abb(n, x, y, z, q1, q2, q3, q4):
    return (
        f"    MoveL [[{x:.3f},{y:.3f},{z:.3f}],[{q1:.9f},{q2:.9f},{q3:.9f},{q4:.9f}],"
        f"[0,-1,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v100,fine,tool0;\n"
    )


def _abb_pose(n, x, y, z, q1, q2, q3, q4):
    return f"  VAR pose p{n}:=[[{x:.3f},{y:.3f},{z:.3f}],[{q1:.9f},{q2:.9f},{q3:.9f},{q4:.9f}]];\n"


def _fanuc(n, x, y, z, u, v, w):
    return (
        f"P[{n}]{{\n   GP1:\n\tUF : 0, UT : 0,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
        f"\tX = {x:9.3f}  mm,\tY = {y:9.3f}  mm,\tZ = {z:9.3f}  mm,\n"
        f"\tW = {w:9.3f} deg,\tP = {v:9.3f} deg,\tR = {u:9.3f} deg\n}};\n"
    )


def _register(n, x, y, z, u, v, w):
    return (
        f"     [1,{n}] =   'pin {n}' \n  Group: 1   Config: F U T, 0, 0, 0\n"
        f"  X: {x:9.3f}   Y: {y:9.3f}   Z: {z:9.3f}\n  W: {w:9.3f}   P: {v:9.3f}   R: {u:9.3f}\n"
    )


def _ur(n, x, y, z, a, b, c):
    place = f"{x / 1000:.6f}, {y / 1000:.6f}, {z / 1000:.6f}"
    return f"  movel(p[{place}, {a:.9f}, {b:.9f}, {c:.9f}], a=1.2)\n"


def _ur_printed(n, x, y, z, a, b, c):
    return f"pin_{n}=p[{x:.3f}mm, {y:.3f}mm, {z:.3f}mm, {a:.6f}rad, {b:.6f}rad, {c:.6f}rad]\n"


def _melfa(n, x, y, z, u, v, w):
    return f"P{n}=({x:+.2f},{y:+.2f},{z:+.2f},{w:+.2f},{v:+.2f},{u:+.2f})(7,0)\n"


def _spel(n, x, y, z, u, v, w):
    return f"P{n}(pin{n}) = XY({x:.3f}, {y:.3f}, {z:.3f}, {u:.3f}, {v:.3f}, {w:.3f}) /R /A /NF /0\n"


def _where(n, x, y, z, u, v, w):
    return f"Pin {n}: X: {x:.3f} Y: {y:.3f} Z: {z:.3f} U: {u:.3f} V: {v:.3f} W: {w:.3f} /R /0\n"


def _ros(n, x, y, z, q1, q2, q3, q4):
    return (
        f"- position: {{x: {x / 1000:.6f}, y: {y / 1000:.6f}, z: {z / 1000:.6f}}}\n"
        f"  orientation: {{x: {q2:.9f}, y: {q3:.9f}, z: {q4:.9f}, w: {q1:.9f}}}\n"
    )


def _with(extra):
    return tuple((*row[:3], *more) for row, more in zip(TILTED, extra, strict=True))


def _columns(rows, names, separator, mark="."):
    lines = [separator.join(["name", *(f"P{n}" for n in range(1, len(rows) + 1))])]
    for name, values in zip(names, zip(*rows, strict=True), strict=True):
        lines.append(separator.join([name, *(f"{v:.3f}".replace(".", mark) for v in values)]))
    return "\n".join(lines) + "\n"


def _numpy(rows, form=lambda value: f"{value: .8e}"):
    written = []
    for row in rows:
        words = [form(value) for value in row]
        written.append(f"[{' '.join(words[:4])}\n  {' '.join(words[4:])}]")
    return "[" + "\n ".join(written) + "]\n"


def _thousands(rows):
    lines = ["X;Y;Z;U"]
    for x, y, z, u in rows:
        grouped = [
            f"{v:,.3f}".replace(",", "_").replace(".", ",").replace("_", ".") for v in (x, y)
        ]
        lines.append(
            ";".join([*grouped, f"{z:.3f}".replace(".", ","), f"{u:.1f}".replace(".", ",")])
        )
    return "\n".join(lines) + "\n"


def _message(x, y, z, q1, q2, q3, q4):
    place = dict(zip("xyz", (x / 1000, y / 1000, z / 1000), strict=True))
    turn = dict(zip("xyzw", (q2, q3, q4, q1), strict=True))
    return {"header": {"seq": 1}, "pose": {"position": place, "orientation": turn}}


SEEDS = {
    "kuka.dat": ("DEFDAT PIN\n" + _each(_kuka) + "ENDDAT\n", {}),
    "kuka.src": ("DEF PIN()\nPTP XHOME\n" + _each(_kuka_moves) + "END\n", {}),
    "kuka.txt": (
        "".join(_each(_kuka).splitlines(keepends=True)[::2]).replace("DECL E6POS ", ""),
        {},
    ),
    "abb.mod": (
        "MODULE Pin\n  PROC main()\n" + _each(_abb, _with(QUATERNIONS)) + "  ENDPROC\nENDMODULE\n",
        {},
    ),
    "abb_pose.mod": ("MODULE Pin\n" + _each(_abb_pose, _with(QUATERNIONS)) + "ENDMODULE\n", {}),
    "fanuc.ls": (_each(_fanuc), {}),
    "posreg.va": (
        "[*POSREG*]$POSREG  Storage: CMOS  : ARRAY[1,9] OF Position Reg\n" + _each(_register),
        {},
    ),
    "ur.script": ("def pin():\n" + _each(_ur, _with(VECTORS)) + "end\n", {}),
    "ur.txt": (_each(_ur_printed, _with(VECTORS)), {}),
    "melfa.prg": (_each(_melfa), {}),
    "spel.txt": (_each(_spel), {}),
    "where.txt": (_each(_where), {}),
    "ros.yaml": ("header:\n  seq: 1\nposes:\n" + _each(_ros, _with(QUATERNIONS)), {}),
    "ros.json": (json.dumps([_message(*row) for row in _with(QUATERNIONS)], indent=1), {}),
    "rows.json": (json.dumps([list(row) for row in PLANAR], indent=1), {"columns": "x,y,z,u"}),
    "numpy.txt": (_numpy(TILTED), {"columns": "x,y,z,u,v,w"}),
    "array.txt": (
        "array([" + ",\n       ".join(str(list(row)) for row in PLANAR) + "])\n",
        {"columns": "x,y,z,u"},
    ),
    "columns.csv": (_columns(PLANAR, ("X [mm]", "Y [mm]", "Z [mm]", "U [deg]"), ";", ","), {}),
    "columns.txt": (_columns(TILTED, "XYZABC", "\t"), {"euler": "kuka"}),
    "thousands.csv": (
        _thousands(
            ((1131.9, 1103.25, -50, 0.0), (1140.5, 1087.5, -50, 90.0), (999.25, 1000, -50, 5.5))
        ),
        {},
    ),
    "quaternions.csv": (
        "x_mm,y_mm,z_mm,qw,qx,qy,qz\n"
        + "".join(",".join(f"{v:.9f}" for v in row) + "\n" for row in _with(QUATERNIONS)),
        {},
    ),
    "one_kuka.txt": (_each(_kuka_moves, TILTED[1:2]), {}),
    "one.json": (json.dumps({"x_mm": 287.5, "y_mm": 103.25, "z_mm": -50.0, "u_deg": 90.0}), {}),
    "one_where.txt": (_each(_where, TILTED[1:2]), {}),
    "one_spel.txt": (_each(_spel, TILTED[1:2]), {}),
    "one_melfa.prg": (_each(_melfa, TILTED[1:2]), {}),
    "one_fanuc.ls": (_each(_fanuc, TILTED[1:2]), {}),
}
"""By file name: the text, and the options for data that the file lacks."""
