#!/bin/sh
# Opens the soft top once more, coupled: toile-drive moves the frame and hears what the cloth does to it, toile-simulate moves the cloth.
# Both read what `make softtop` has left in the folder. usage: coupled.sh BIN FOLDER
set -eu
bin=$1
folder=$2
here=$(dirname "$0")
couple='{endpoint: "tcp://127.0.0.1:7118", timeout: 300 s}'

"$bin/toile-drive" "$here/../../samples/mechanisms/softtop.yaml" "$folder/motion.csv" --spec "$here/opening.yaml" --steps variable \
  --couple.endpoint tcp://127.0.0.1:7118 --couple.timeout '300 s' --plot "$folder/coupled_torque.png" -o "$folder/coupled_torque.csv" --quiet &
drive=$!
trap 'kill "$drive" 2>/dev/null || true' EXIT
"$bin/toile-simulate" "$folder/closed.ply" "$folder/frame.ply" --spec "$here/opening_simulation.yaml" --couple "$couple" \
  --record "$folder/coupled_record.csv" -o "$folder/opened_coupled.ply"
wait "$drive"
trap - EXIT
echo "made $folder/opened_coupled.ply, coupled_torque.csv and coupled_torque.png"
