#!/usr/bin/env bash
# A tiny experiment four ways: by hilt itself, by Snakemake, by a real slurmctld and slurmd on loopback, and by Snakemake's executor for Slurm
# there. All must leave the same bytes, the two in the middle also when they are killed (SIGKILL) at five random moments and begun again.
#
#   run.sh HILT
#
# Needs root. Installs what is missing: Snakemake and its executor into target/cluster/venv (pip, Python 3.11), Slurm and munge (apt).
set -eu -o pipefail
export LC_ALL=C

hilt=$(realpath -- "${1:?usage: run.sh HILT}")
root=$(cd -- "$(dirname -- "$0")/../.." && pwd)
work=$root/target/cluster
venv=$work/venv
threads=2

say() { echo "cluster-test: $*"; }
die() { echo "cluster-test: $*" >&2; exit 1; }

install() {
    if ! "$venv/bin/python" -c "import snakemake, snakemake_executor_plugin_slurm" 2> /dev/null; then
        say "installs snakemake and its executor for slurm into $venv"
        python3 -m venv "$venv" > "$work/pip.log" 2>&1 \
            && "$venv/bin/pip" install -q snakemake snakemake-executor-plugin-slurm >> "$work/pip.log" 2>&1 \
            || die "snakemake is missing and could not be installed (needs python3-venv and a package index): $work/pip.log"
    fi
    local missing= program
    for program in slurmctld slurmd sbatch munged setpriv; do
        command -v "$program" > /dev/null || missing="$missing $program"
    done
    if [ -n "$missing" ]; then
        [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null || die "missing:$missing; only root with apt-get could install it"
        say "installs slurm and munge"
        { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends slurmctld slurmd slurm-client munge; } \
            > "$work/apt.log" 2>&1 || die "missing:$missing; apt-get could not install it: $work/apt.log"
    fi
    [ "$(id -u)" = 0 ] || die "slurmd on loopback needs root"
}

pids=()
stop() {
    local pid
    for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done
    for pid in "${pids[@]}"; do wait "$pid" 2> /dev/null || true; done
    [ -z "$linked" ] || rm -f "$own_conf"
    # What the daemons said stays where something went wrong.
    [ -z "$done" ] || rm -rf "$cluster"
}
done= cluster= linked=
own_conf=/etc/slurm/slurm.conf
trap stop EXIT

# Daemons of our own beside whatever the machine has: own ports, own directories, own key.
cluster() {
    local dir host
    host=$(hostname -s)
    # The name of a socket is short, and munge's own user must come this far.
    dir=$(mktemp -d /tmp/hilt-cluster.XXXXXX)
    cluster=$dir
    chmod 0711 "$dir"
    mkdir "$dir"/{state,spool,munge}
    head -c 1024 /dev/urandom > "$dir/munge/key"
    chown -R munge: "$dir/munge"
    chmod 0400 "$dir/munge/key"
    chmod 0755 "$dir/munge"
    setpriv --reuid munge --regid munge --clear-groups munged --foreground --force --key-file="$dir/munge/key" --socket="$dir/munge/socket" \
        --pid-file="$dir/munge/pid" --log-file="$dir/munge/log" --seed-file="$dir/munge/seed" > "$dir/munged.out" 2>&1 &
    pids+=($!)
    cat > "$dir/slurm.conf" <<EOF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=46817
SlurmdPort=46818
AuthType=auth/munge
AuthInfo=socket=$dir/munge/socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0,bf_interval=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=1000 State=UNKNOWN
PartitionName=loopback Nodes=$host Default=YES MaxTime=INFINITE State=UP
EOF
    export SLURM_CONF=$dir/slurm.conf
    local tries=0
    until [ -S "$dir/munge/socket" ]; do
        tries=$((tries + 1))
        [ $tries -lt 100 ] || die "munged does not start: $dir/munge/log"
        sleep 0.1
    done
    slurmctld -D > "$dir/slurmctld.out" 2>&1 &
    pids+=($!)
    slurmd -D > "$dir/slurmd.out" 2>&1 &
    pids+=($!)
    tries=0
    until [ "$(sinfo --noheader --format=%t 2> /dev/null)" = idle ]; do
        tries=$((tries + 1))
        [ $tries -lt 600 ] || die "slurm does not come up: $dir/slurmctld.log, $dir/slurmd.log"
        sleep 0.1
    done
    say "$(slurmctld -V) runs on loopback"
}

kills=5
files() { find runs -type f | wc -l; }
# Until some more of the run is there, while `WORKS...` says that it goes on, and then a random moment: each kill finds work.
a_moment() {
    local before
    before=$(files)
    while "$@" && [ "$(files)" -lt $((before + 5)) ]; do sleep 0.05; done
    sleep "0.$((RANDOM % 6))"
}

snakemake() { "$venv/bin/snakemake" --cores "$threads" --snakefile runs/experiments/tiny/Snakefile "$@" >> snakemake.log 2>&1; }

killed_snakemake() {
    local kill pid
    for kill in $(seq $kills); do
        setsid "$venv/bin/snakemake" --cores "$threads" --snakefile runs/experiments/tiny/Snakefile --rerun-incomplete >> snakemake.log 2>&1 &
        pid=$!
        a_moment kill -0 "$pid"
        kill -KILL -- "-$pid" 2> /dev/null || true
        wait "$pid" 2> /dev/null || true
        say "snakemake killed ($kill): $(files) files are there"
        snakemake --unlock
    done
    snakemake --rerun-incomplete || die "snakemake failed: $PWD/snakemake.log"
}

is_queued() { squeue --noheader --format=%i 2> /dev/null | grep -q .; }

queue_is_empty() {
    local tries=0
    while is_queued; do
        tries=$((tries + 1))
        [ $tries -lt 1200 ] || die "slurm is not done after ten minutes: $PWD"
        sleep 0.5
    done
}

killed_slurm() {
    local kill
    for kill in $(seq $kills); do
        bash runs/experiments/tiny/submit.sh --time=10 > submitted
        a_moment is_queued
        scancel --full --signal=KILL --user root --state RUNNING 2> /dev/null || true
        scancel --user root
        queue_is_empty
        say "slurm killed ($kill): $(files) files are there"
    done
    by_slurm
}

# Slurm keeps no accounts here, so jobs are asked for by squeue and have none.
snakemake_on_slurm() {
    "$venv/bin/snakemake" --executor slurm --jobs "$threads" --snakefile runs/experiments/tiny/Snakefile --slurm-status-command squeue \
        --slurm-init-seconds-before-status-checks 3 --seconds-between-status-checks 3 --default-resources \
        slurm_partition=loopback runtime=10 mem_mb=200 >> snakemake.log 2>&1
}

by_slurm() {
    bash runs/experiments/tiny/submit.sh --time=10 > submitted || die "sbatch failed: $PWD/submitted"
    queue_is_empty
}

# What must not depend on who ran it.
listing() { (cd "$1/runs/experiments/tiny" && find . -type f ! -path './logs/*' ! -name '.*' ! -name times.csv ! -name Snakefile ! -name submit.sh -print0 | sort -z | xargs -0 sha256sum); }

mkdir -p "$work"
install
for way in plain snakemake snakemake-killed slurm slurm-killed snakemake-on-slurm; do
    rm -rf "${work:?}/$way"
    mkdir -p "$work/$way"
    cp "$root/tests/cluster/tiny.toml" "$work/$way"
done

# compare WAY: the bytes of the plain run.
compare() {
    listing "$work/$1" > "$work/$1.sums"
    diff "$work/plain.sums" "$work/$1.sums" || die "$1 left other bytes; logs are in $work/$1/runs/experiments/tiny/logs"
    "$hilt" experiment tiny.toml --threads "$threads" 2>&1 > /dev/null | grep -q ' 0 of .* steps to do' || die "hilt would run steps of $1 again"
    say "$1: the same bytes"
}

cd "$work/plain"
"$hilt" experiment tiny.toml --quiet --threads "$threads" --jobs 1 > /dev/null
listing "$work/plain" > "$work/plain.sums"
say "plain: $(wc -l < "$work/plain.sums") files"

cd "$work/snakemake"
"$hilt" experiment tiny.toml --quiet --threads "$threads" --jobs 1 --emit snakemake
began=$SECONDS
snakemake || die "snakemake failed: $PWD/snakemake.log"
took=$((SECONDS - began))
"$venv/bin/snakemake" --cores "$threads" --snakefile runs/experiments/tiny/Snakefile --dry-run 2>&1 | grep -q 'Nothing to be done' \
    || die "snakemake would run steps again that are done"
say "snakemake $("$venv/bin/snakemake" --version) takes $took s"
compare snakemake
cd "$work/snakemake-killed"
"$hilt" experiment tiny.toml --quiet --threads "$threads" --jobs 1 --emit snakemake
killed_snakemake
compare snakemake-killed

cluster
cd "$work/slurm"
"$hilt" experiment tiny.toml --quiet --threads 1 --jobs 1 --emit slurm
began=$SECONDS
by_slurm
say "slurm takes $((SECONDS - began)) s"
compare slurm
cd "$work/slurm-killed"
"$hilt" experiment tiny.toml --quiet --threads 1 --jobs 1 --emit slurm
killed_slurm
compare slurm-killed
# The executor takes SLURM_CONF from its jobs, which then look where Slurm's own is.
ways=five
if [ -e "$own_conf" ]; then
    say "snakemake's executor for slurm is left out: this machine has a Slurm of its own"
else
    ln -sf "$SLURM_CONF" "$own_conf" && linked=yes
    cd "$work/snakemake-on-slurm"
    "$hilt" experiment tiny.toml --quiet --threads "$threads" --jobs 1 --emit snakemake
    snakemake_on_slurm || die "snakemake's executor for slurm failed: $PWD/snakemake.log"
    compare snakemake-on-slurm
    ways=six
fi
say "all $ways ways leave the same $(wc -l < "$work/plain.sums") files"
done=yes
