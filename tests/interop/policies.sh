#!/bin/sh
# Trains a tiny policy of every task and kind of network, exports it and records 10,000 states and actions of it. Usage: tests/interop/policies.sh HILT RUNS
# RUNS/TASK holds dataset and dynamics of each task (make smoke leaves them); the policies go to RUNS/policies/NAME. Another robot's are made here.
# Those of other programs' datasets, for which there is no simulator to record in, go to RUNS/foreign/NAME.
set -eu
[ $# -eq 2 ] || { echo "usage: $0 HILT RUNS" >&2; exit 2; }
hilt=$1 runs=$2
root=$(cd "$(dirname "$0")/../.." && pwd)
tiny="train.warm_start_updates=50 train.epochs=1 train.min_updates=0 train.select_episodes=1"
# Policies that have learned little do not end early: 80 episodes of 300 steps leave room for some that do.
episodes=80

# policy NAME METHOD "FLAGS" "SETTINGS": demos and dynamics of RUNS/FROM, where the method has any.
policy() {
    out=$runs/policies/$1 method=$2 flags=$3 settings=$4
    case $method in
        ppo) learns= ;;
        bc | bc-rl) learns="--dataset $from/dataset" ;;
        *) learns="--dataset $from/dataset --dynamics $from/dynamics.safetensors" ;;
    esac
    echo "  $1"
    "$hilt" train $flags --quiet --method "$method" $learns --sets "$tiny $settings" --out "$out/policy.safetensors"
    "$hilt" export onnx "$out/policy.safetensors" --out "$out/policy.onnx" --quiet
    "$hilt" evaluate $flags --quiet --policy "$out/policy.safetensors" --episodes $episodes --set evaluate.horizon_steps=300 --seed 1 --record "$out/rollouts" > /dev/null
}

echo "policies in $runs/policies"
for task in pick-up pick-and-place stack tower sort bin; do
    from=$runs/$task
    for features in raw fk fk-near; do
        policy "$task-$features" hil "--task $task" "train.features=$features"
    done
done
from=$runs/stack
policy stack-masked hil "--task stack" "train.mask_dq=true"
policy stack-relu hil "--task stack" "train.activation=relu train.hidden_layers=1"
from=$runs/pick-up
ppo="train.ppo.total_steps=640 train.ppo.worlds=8 train.ppo.steps=16 train.ppo.horizon_steps=20"
policy pick-up-ppo ppo "--task pick-up" "$ppo"
# it solves the task, in some 90 steps
episodes=120
policy pick-up-bc-rl bc-rl "--task pick-up" "$ppo"
# As long as a user trains: weights of another size than after 50 updates.
episodes=130 few=$tiny tiny=
policy pick-up-bc bc "--task pick-up" ""
episodes=80 tiny=$few
for robot in panda ur5e "$root/fixtures/robots/five.toml"; do
    name=$(basename "$robot" .toml)
    from=$runs/$name-stack flags="--task stack --robot $robot"
    "$hilt" plan $flags --quiet --allow-dropped --episodes 12 --out "$from/plans.parquet"
    "$hilt" simulate $flags --quiet --allow-dropped --plans "$from/plans.parquet" --out "$from/recordings"
    "$hilt" convert $flags --quiet --allow-dropped --recordings "$from/recordings" --out "$from/dataset"
    "$hilt" pretrain $flags --quiet --dataset "$from/dataset" --set pretrain.epochs=2 --out "$from/dynamics.safetensors"
    policy "$name-stack" hil "$flags" "train.features=fk-near"
done
for data in lerobot pandas; do
    out=$runs/foreign/$data
    echo "  $data"
    "$hilt" train --quiet --method bc --dataset "$root/fixtures/foreign/$data" --out "$out/policy.safetensors"
    "$hilt" export onnx "$out/policy.safetensors" --out "$out/policy.onnx" --quiet
done
