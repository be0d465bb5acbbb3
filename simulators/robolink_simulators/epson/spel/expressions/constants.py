"""Predefined constants (docs/reference/spel.md 1.2); a build puts their values in their place."""

from typing import Final

from robolink_simulators.epson.spel.expressions.values import Value

_NUMBERS = """
    on=1 off=0 high=1 low=0 righty=1 lefty=2 above=1 below=2 noflip=1 flip=2
    j1=1 j2=2 j3=4 j4=8 j5=16 j6=32 j7=64
    arc_short=0 arc_long=1 arc_plus=1 arc_minus=-1 error_doingmotion=2999 error_nomotion=2998
    sing_none=0 sing_thru=1 sing_thrurot=2 sing_vsd=3 sing_auto=4 sing_avoid=5
    xylim_standard=0 xylim_strict=1 coord_x_plus=1 coord_y_plus=2 coord_z_plus=3 coord_x_minus=4
    coord_y_minus=5 coord_z_minus=6 coord_all=4 ac_local=0 ac_tool=1 mode_plane=2 mode_space=3
    iotype_input=0 iotype_output=1 iotype_memory=2 iosize_bit=1 iosize_byte=8 iosize_word=16
    langid_english=0 langid_japanese=1 langid_german=2 langid_french=3 langid_simplified_chinese=4
    langid_traditional_chinese=5 withmove=0 withoutmove=1 shutdown_all=0 shutdown_restart=1
    setlatch_port_cu_0=24 setlatch_port_cu_1=25 setlatch_port_cu_2=26 setlatch_port_cu_3=27
    setlatch_triggermode_trailingedge=0 setlatch_triggermode_leadingedge=1 withtoolarm=0
    withouttoolarm=1 shutdown_epsonrc2=2
    mb_ok=0 mb_okcancel=1 mb_abortretryignore=2 mb_yesnocancel=3 mb_yesno=4 mb_retrycancel=5
    mb_iconstop=16 mb_iconquestion=32 mb_iconexclamation=48 mb_iconinformation=64
    mb_defbutton1=0 mb_defbutton2=256
    idok=1 idcancel=2 idabort=3 idretry=4 idignore=5 idyes=6 idno=7
    mode_standard=0 mode_boost=1 mode_low=2 devid_self=21 devid_tp=24
"""

CONSTANTS: Final[dict[str, Value]] = {
    "true": True,
    "false": False,
    "cr": "\r",
    "lf": "\n",
    "crlf": "\r\n",
    **{name: int(number) for name, number in (pair.split("=") for pair in _NUMBERS.split())},
}
