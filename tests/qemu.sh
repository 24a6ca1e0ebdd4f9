#!/usr/bin/env bash
# The same bytes on other processors: a tiny run of all stages, natively and under qemu-user as processors with and without FMA; natively
# with every kernel that this processor has; and with a mathematical library that errs in the last place, for nothing may ask the
# system's. Compares all artefacts. Opt-in (minutes): make qemu, or tests/qemu.sh [CPU ...]. Needs a release build, qemu-x86_64, cc.
set -euo pipefail
cd "$(dirname "$0")/.."
HILT=${HILT:-${CARGO_TARGET_DIR:-target}/release/hilt}
TASK=${TASK:-stack}
CPUS=("$@")
[ $# -gt 0 ] || CPUS=(Nehalem IvyBridge Haswell,-fma Haswell max)
SET=${SET:-plan.episodes=3 pretrain.epochs=1 train.warm_start_updates=3 train.epochs=1 train.min_updates=0 evaluate.episodes=1 evaluate.horizon_steps=50}

missing() { echo "error: $1 is missing: $2" >&2; exit 2; }
[ -x "$HILT" ] || missing "$HILT" "make build"
command -v qemu-x86_64 >/dev/null || missing qemu-x86_64 "install qemu-user"
command -v cc >/dev/null || missing cc "install a C compiler"
[ "$(uname -m)" = x86_64 ] || missing "an x86-64 processor" "the binary must be one for x86-64"

WORK=$(mktemp -d)
trap 'rm -rf "$WORK"' EXIT

# run NAME COMMAND...: all stages with COMMAND before the binary; hashes into $WORK/NAME.sums.
run() {
    local name=$1 dir=$WORK/$1
    shift
    local flags=(--pipeline "pipelines/$TASK.toml" --task "$TASK" --seed 0 --quiet) key
    for key in $SET; do flags+=(--set "$key"); done
    mkdir "$dir"
    stage() { "$@" "${flags[@]}" >/dev/null 2>"$WORK/words" || [ $? -eq 3 ] || { cat "$WORK/words" >&2; exit 1; }; }
    stage "$@" "$HILT" plan --out "$dir/plans.parquet"
    stage "$@" "$HILT" simulate --plans "$dir/plans.parquet" --out "$dir/recordings"
    stage "$@" "$HILT" convert --recordings "$dir/recordings" --out "$dir/dataset"
    stage "$@" "$HILT" pretrain --dataset "$dir/dataset" --out "$dir/dynamics.safetensors"
    stage "$@" "$HILT" train --dataset "$dir/dataset" --dynamics "$dir/dynamics.safetensors" --out "$dir/policy.safetensors"
    stage "$@" "$HILT" evaluate --policy "$dir/policy.safetensors" --out "$dir/evaluation.json" --record "$dir/rollouts"
    (cd "$dir" && find . -type f | LC_ALL=C sort | xargs sha256sum) >"$WORK/$name.sums"
}

# compare NAME COMMAND...: the same, against the native run.
failed=0
compare() {
    local began=$SECONDS
    run "$@"
    local files others
    files=$(wc -l <"$WORK/native.sums")
    others=$(diff "$WORK/native.sums" "$WORK/$1.sums" | sed -n 's/^> [0-9a-f]*  //p' | tr '\n' ' ')
    if [ -z "$others" ] && cmp -s "$WORK/native.sums" "$WORK/$1.sums"; then
        printf '%-24s %3d s  %d files, all the same\n' "$1" $((SECONDS - began)) "$files"
    else
        printf '%-24s %3d s  %d files, others: %s\n' "$1" $((SECONDS - began)) "$files" "$others"
        failed=1
    fi
}

run native env
for kernel in portable avx2 avx512; do
    if HILT_KERNEL=$kernel "$HILT" settings --task "$TASK" >/dev/null 2>&1; then
        compare "kernel-$kernel" env HILT_KERNEL="$kernel"
    fi
done

# Every result one unit in the last place too large.
cat >"$WORK/off.c" <<'C'
#define _GNU_SOURCE
#include <dlfcn.h>
#include <math.h>
#define ONE(f, type, next) type f(type x) { type (*of)(type) = (type (*)(type))dlsym(RTLD_NEXT, #f); return next(of(x), (type)INFINITY); }
#define TWO(f, type, next) \
    type f(type x, type y) { type (*of)(type, type) = (type (*)(type, type))dlsym(RTLD_NEXT, #f); return next(of(x, y), (type)INFINITY); }
#define BOTH(f, type, next) void f(type x, type *s, type *c) { \
    void (*of)(type, type *, type *) = (void (*)(type, type *, type *))dlsym(RTLD_NEXT, #f); \
    of(x, s, c); *s = next(*s, (type)INFINITY); *c = next(*c, (type)INFINITY); }
#define F64(f) ONE(f, double, nextafter)
#define F32(f) ONE(f, float, nextafterf)
F64(sin) F64(cos) F64(tan) F64(asin) F64(acos) F64(atan) F64(sinh) F64(cosh) F64(tanh) F64(exp) F64(exp2) F64(expm1) F64(log) F64(log2)
F64(log10) F64(log1p) F64(cbrt) F32(sinf) F32(cosf) F32(tanf) F32(asinf) F32(acosf) F32(atanf) F32(tanhf) F32(expf) F32(exp2f) F32(logf)
F32(log2f) F32(log10f) F32(cbrtf) TWO(pow, double, nextafter) TWO(atan2, double, nextafter) TWO(hypot, double, nextafter)
TWO(powf, float, nextafterf) TWO(atan2f, float, nextafterf) TWO(hypotf, float, nextafterf) BOTH(sincos, double, nextafter)
BOTH(sincosf, float, nextafterf)
C
cc -O1 -fno-builtin -shared -fPIC -o "$WORK/off.so" "$WORK/off.c" -ldl
compare library-off env LD_PRELOAD="$WORK/off.so"

for cpu in "${CPUS[@]}"; do
    compare "qemu-$cpu" qemu-x86_64 -cpu "$cpu"
done
exit $failed
