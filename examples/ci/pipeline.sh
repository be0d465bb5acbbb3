#!/bin/sh
# What a pipeline does with simulated cells, in plain shell. It ends with another code than 0 at the first surprise.
set -eu

robolink sim run cells.toml --check
robolink sim run cells.toml --wait-ready --with-parent --idle-exit 300 > sim.json

told() { python3 -c 'import json, sys
it = json.load(open("sim.json"))
for key in sys.argv[1:]: it = it[key]
print(it)' "$@"; }

trap 'kill "$(told pid)"' EXIT

for cell in press-1 glue; do
    ROBOLINK_STATE_DIR="$(told cells "$cell" state_dir)"
    export ROBOLINK_STATE_DIR
    robolink -c "$(told cells "$cell" url)" status
    robolink -c "$(told cells "$cell" url)" tool set 2 --x 10 --y 0 --z -50 --yes
    robolink sim ctl --at "$(told cells "$cell" control)" truth > "$cell.txt"
    grep -q "10.000" "$cell.txt"
done

# An answer that is lost: nobody knows whether the tool was written, and robolink says so (6).
ROBOLINK_STATE_DIR="$(told cells press-1 state_dir)"
export ROBOLINK_STATE_DIR
robolink sim ctl --at "$(told cells press-1 control)" add_fault action=drop_reply match="TLSet 3, XY"
code=0
robolink -c "$(told cells press-1 url)" tool set 3 --x 1 --y 2 --z -50 --yes || code=$?
[ "$code" = 6 ]
robolink -c "$(told cells press-1 url)" recover --yes
robolink sim ctl --at "$(told cells press-1 control)" log > wire.txt
echo "The pipeline is through."
