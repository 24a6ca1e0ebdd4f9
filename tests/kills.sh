#!/usr/bin/env bash
# `make all` killed at random moments of every stage, then run again: the same bytes as undisturbed, nothing left over, checkpoints and
# finished pieces used.
#
#   tests/kills.sh [N [SEED]]    N moments (60), half of them with SIGKILL and half with SIGTERM to the whole process group
#
# Run from the project's root after `make build`; takes about ten seconds a moment. Exits with 1 at the end if anything is not as it was.
set -u -o pipefail
# Every make gets a process group of its own.
set -m
count=${1:-60}
RANDOM=${2:-1}
cd "$(dirname "$0")/.." || exit
# More than one block of plans.
set_="plan.episodes=80 pretrain.epochs=30 train.warm_start_updates=1500 train.epochs=4 train.min_updates=0 evaluate.episodes=30"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
run=$scratch/runs/pick-up
stages=(plan simulate convert pretrain train evaluate)
# From the signal to the end of the last process.
patience_s=60

make_all() { make all TASK=pick-up RUNS="$scratch/runs" SET="$set_" CHECKPOINT=1 "$@"; }
hashes() { (cd "$1" && find . -type f ! -path './logs/*' ! -path '*/.hilt-*' | LC_ALL=C sort | xargs "${sha256[@]}"); }
sha256=(sha256sum)
command -v sha256sum > /dev/null || sha256=(shasum -a 256)
leftovers() { find "$run" -name '.hilt-*' -o -name '*.new' -o -name '.*.begun' -o -name '*.unfinished'; }
pieces() { find "$run" -path "*.unfinished/run-*/*" ! -name '.*' | wc -l; }
# Processes of a group that still run.
alive() { ps -A -o pgid=,stat= | awk -v group="$1" '$1 == group && $2 !~ /^Z/ { n++ } END { exit !n }'; }
fault() { echo "  FAULT: $*"; faults=$((faults + 1)); }

make_all > "$scratch/undisturbed.txt" 2>&1 || { cat "$scratch/undisturbed.txt"; exit 1; }
mv "$run" "$scratch/undisturbed"
hashes "$scratch/undisturbed" > "$scratch/expected.txt"
milliseconds=()
for stage in "${stages[@]}"; do
    milliseconds+=("$(awk '/^wall time/ { ms = 1000 * $3 } END { print int(ms) }' "$scratch/undisturbed/logs/$stage.log")")
done
echo "undisturbed: ${stages[*]} took ${milliseconds[*]} ms"

# The shell announces every job that a signal ends.
exec 2> /dev/null
faults=0 too_late=0 dirty=0 continued=0 trained=(0 0) kept=(0 0) used=(0 0) hits=(0 0 0 0 0 0)
for ((i = 0; i < count; i++)); do
    rm -rf "$run"
    at=$((i / 2 % 6)) kind=$((i % 2))
    signal=KILL
    [ "$kind" -eq 0 ] || signal=TERM
    stage=${stages[at]}
    delay_ms=$((RANDOM % (milliseconds[at] + 100)))
    make_all > "$scratch/first.txt" 2>&1 &
    group=$!
    until [ -e "$run/settings/.$stage.begun" ] || ! kill -0 "$group" 2> /dev/null; do sleep 0.005; done
    sleep "$((delay_ms / 1000)).$(printf '%03d' $((delay_ms % 1000)))"
    kill -s "$signal" -- "-$group" 2> /dev/null
    for ((waited = 0; waited < patience_s * 20; waited++)); do
        alive "$group" || break
        sleep 0.05
    done
    alive "$group" && { fault "still running $patience_s s after $signal"; kill -s KILL -- "-$group"; }
    wait "$group" 2> /dev/null

    hit=none
    for j in 0 1 2 3 4 5; do
        [ -e "$run/settings/.${stages[j]}.begun" ] || continue
        hit=${stages[j]} hits[j]=$((hits[j] + 1))
    done
    [ "$hit" != none ] || too_late=$((too_late + 1))
    [ -z "$(find "$run" -name '.hilt-*')" ] || dirty=$((dirty + 1))
    finished=$(pieces)
    # Training has begun to learn when it has said so.
    checkpoint=no
    if [ "$hit" = train ] && ! [ -e "$run/policy.safetensors" ] && grep -q '^\(warm-start\|hil\): ' "$run/logs/train.log"; then
        trained[kind]=$((trained[kind] + 1)) checkpoint=missing
        if [ -e "$run/policy.checkpoint.safetensors" ]; then kept[kind]=$((kept[kind] + 1)) checkpoint=kept; fi
    fi

    make_all RESUME=1 > "$scratch/second.txt" 2>&1 || { fault "the second make all failed"; tail -n 5 "$scratch/second.txt"; }
    if grep -q '^train: continues after' "$scratch/second.txt"; then used[kind]=$((used[kind] + 1)) checkpoint=used; fi
    if grep -q '^\(plan\|simulate\): goes on: ' "$scratch/second.txt"; then
        continued=$((continued + 1))
    elif [ "$finished" -gt 0 ]; then
        fault "$finished finished pieces were not used"
    fi
    printf '%3d %-4s %4d ms into %-8s hit %-8s pieces %3d checkpoint %s\n' "$((i + 1))" "$signal" "$delay_ms" "$stage" "$hit" "$finished" "$checkpoint"
    hashes "$run" | diff "$scratch/expected.txt" - > "$scratch/difference.txt" || { fault "other bytes"; cat "$scratch/difference.txt"; }
    left=$(leftovers)
    [ -z "$left" ] || fault "left over: $left"
    [ "$signal $checkpoint" != "TERM missing" ] || fault "TERM while training left no checkpoint"
done
echo "$count kills: in ${stages[*]} ${hits[*]}, between two stages or after the last $too_late"
echo "SIGKILL: ${trained[0]} while learning, a checkpoint was there ${kept[0]} times and used ${used[0]} times (one a second)"
echo "SIGTERM: ${trained[1]} while learning, a checkpoint was there ${kept[1]} times and used ${used[1]} times"
echo "planning and simulation went on from finished pieces $continued times"
echo "unfinished .hilt-* files right after the kill: $dirty; faults (other bytes, left over, failed, no checkpoint after TERM): $faults"
[ "$faults" -eq 0 ]
