#!/bin/sh
# What a pipeline does with simulated cells, in plain shell. It ends with another code than 0 at the first surprise.
set -eu

robolink sim run cells.toml --check
robolink sim run cells.toml --wait-ready --with-parent --idle-exit 300 > sim.json

told() { python3 -c 'import json, sys
it = json.load(open(sys.argv[1]))
for key in sys.argv[2:]: it = it[int(key) if isinstance(it, list) else key]
print(it)' "$@"; }

trap 'kill "$(told sim.json pid)"' EXIT

use() {  # a cell by name: its URL, its control API, and a folder of its own for journal and backups
    url="$(told sim.json cells "$1" url)"
    control="$(told sim.json cells "$1" control)"
    ROBOLINK_STATE_DIR="$(told sim.json cells "$1" state_dir)"
    export ROBOLINK_STATE_DIR
}

for cell in press-1 glue; do
    use "$cell"
    robolink -c "$url" status
    robolink -c "$url" tool set 2 --x 10 --y 0 --z -50 --yes
    robolink sim ctl --at "$control" truth > "$cell.txt"
    grep -q "10.000" "$cell.txt"
done

# A needle change by a recipe: the simulated person touches the pin. Your own recipe lies in your repository.
use line
[ -f needle.toml ] || robolink recipe new scara-pin needle.toml
robolink -c "$url" robot motors on
robolink --json -c "$url" change needle.toml --assist "$(told sim.json cells line assist)" --nozzle N7 --yes > change.json
[ "$(told change.json tools 0 verification passed)" = True ]
robolink --json sim ctl --at "$control" truth > truth.json
for axis in x_mm y_mm; do
    python3 -c 'import sys; sys.exit(abs(float(sys.argv[1]) - float(sys.argv[2])) > 0.1)' \
        "$(told change.json tools 0 write read_back $axis)" "$(told truth.json tips 1 $axis)"
done

# An answer that is lost: nobody knows whether the tool was written, and robolink says so (6).
use press-1
robolink sim ctl --at "$control" add_fault action=drop_reply match="TLSet 3, XY"
code=0
robolink -c "$url" tool set 3 --x 1 --y 2 --z -50 --yes || code=$?
[ "$code" = 6 ]
robolink -c "$url" recover --yes
robolink sim ctl --at "$control" log > wire.txt
echo "The pipeline is through."
