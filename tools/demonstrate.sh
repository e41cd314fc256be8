#!/usr/bin/env bash
# Leaves one effect out of a twin, records the emulated rig that has it, and asks what is missing.
# The answer stands beside the truth. The rig and the twin share no law.
set -euo pipefail
out=${1:-recordings/demonstration}
servo=rv_plain
rig=config/rigs/rv_plain.yaml
left_out=gravity amount=4
export OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1

record() {  # family seed: one recording of the rig, and the bag that is made of it
  python -m servo_rig_driver.emulated.make_recording "$1" --rig "$rig" --set "withheld.$left_out=$amount" \
    --seed "$2" --replicate "$2" --list --duration 12 -o "$out/$1_$2.csv" >/dev/null
  servo-identify import "$out/$1_$2.csv" --servo "$servo" -o "$out/bags/$1_$2" >/dev/null
}

rm -rf "$out"
mkdir -p "$out/bags"
echo "recording the emulated rig nine times for 12 s, with $left_out of $amount N m that its twin does not know ..."
for seed in 1 2 3; do
  record speed_ladder $seed & first=$!
  record load_steps $seed & second=$!
  wait $first
  wait $second
  record multisine $seed
done
servo-identify diagnose "$out"/bags/* --servo "$servo" -o "$out/answer" --quiet > "$out/sentence.txt"
echo
echo "left out of the twin: $left_out of $amount N m at the load"
echo "the diagnosis says:   $(tr '\n' ' ' < "$out/sentence.txt")"
echo "the page:             $out/answer/report.html"
