#!/usr/bin/env bash
# A tiny experiment three ways: by hilt itself, by Snakemake, and by a real slurmctld and slurmd on loopback. All must leave the same bytes.
#
#   run.sh HILT
#
# Needs root. Installs what is missing: Snakemake into target/cluster/venv (pip), Slurm and munge (apt).
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
    if ! [ -x "$venv/bin/snakemake" ]; then
        say "installs snakemake into $venv"
        python3 -m venv "$venv" > "$work/pip.log" 2>&1 && "$venv/bin/pip" install -q snakemake >> "$work/pip.log" 2>&1 \
            || die "snakemake is missing and could not be installed (needs python3-venv and a package index): $work/pip.log"
    fi
    if ! command -v slurmctld slurmd sbatch munged > /dev/null; then
        [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null || die "slurmctld, slurmd, sbatch or munged is missing, and only root with apt-get could install it"
        say "installs slurm and munge"
        { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends slurmctld slurmd slurm-client munge; } \
            > "$work/apt.log" 2>&1 || die "slurm or munge is missing and could not be installed: $work/apt.log"
    fi
    [ "$(id -u)" = 0 ] || die "slurmd on loopback needs root"
}

pids=()
stop() {
    local pid
    for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done
    for pid in "${pids[@]}"; do wait "$pid" 2> /dev/null || true; done
}
trap stop EXIT

# Daemons of our own beside whatever the machine has: own ports, own directories, own key.
cluster() {
    local dir=$work/slurm host
    host=$(hostname -s)
    rm -rf "$dir"
    mkdir -p "$dir"/{state,spool,munge}
    chmod 0711 "$work" "$dir"
    head -c 1024 /dev/urandom > "$dir/munge/key"
    chown -R munge: "$dir/munge"
    chmod 0400 "$dir/munge/key"
    chmod 0755 "$dir/munge"
    setpriv --reuid munge --regid munge --clear-groups munged --foreground --force --key-file="$dir/munge/key" --socket="$dir/munge/socket" \
        --pid-file="$dir/munge/pid" --log-file="$dir/munge/log" --seed-file="$dir/munge/seed" &
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
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
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

by_slurm() {
    local job tries=0
    bash runs/experiments/tiny/submit.sh --time=10 > submitted
    cat submitted
    job=$(awk '$1 == "collect:" { print $3 }' submitted)
    while squeue --noheader --format=%i 2> /dev/null | grep -q .; do
        tries=$((tries + 1))
        [ $tries -lt 1200 ] || die "slurm is not done after ten minutes: job $job of $work/slurm-run"
        sleep 0.5
    done
}

# What must not depend on who ran it.
listing() { (cd "$1/runs/experiments/tiny" && find . -type f ! -path './logs/*' ! -name '.*' ! -name times.csv ! -name Snakefile ! -name submit.sh -print0 | sort -z | xargs -0 sha256sum); }

mkdir -p "$work"
install
for way in plain snakemake slurm-run; do
    rm -rf "${work:?}/$way"
    mkdir -p "$work/$way"
    cp "$root/tests/cluster/tiny.toml" "$work/$way"
done

cd "$work/plain"
"$hilt" experiment tiny.toml --threads "$threads" --jobs 1 > /dev/null
listing "$work/plain" > "$work/plain.sums"
say "plain: $(wc -l < "$work/plain.sums") files"

cd "$work/snakemake"
"$hilt" experiment tiny.toml --threads "$threads" --jobs 1 --emit snakemake
"$venv/bin/snakemake" --cores "$threads" --snakefile runs/experiments/tiny/Snakefile > snakemake.log 2>&1 || die "snakemake failed: $work/snakemake/snakemake.log"
"$venv/bin/snakemake" --cores "$threads" --snakefile runs/experiments/tiny/Snakefile --dry-run 2>&1 | grep -q 'Nothing to be done' \
    || die "snakemake would run steps again that are done"
listing "$work/snakemake" > "$work/snakemake.sums"
diff "$work/plain.sums" "$work/snakemake.sums" || die "snakemake left other bytes"
say "snakemake $("$venv/bin/snakemake" --version): the same bytes"

cluster
cd "$work/slurm-run"
"$hilt" experiment tiny.toml --threads 1 --jobs 1 --emit slurm
by_slurm
listing "$work/slurm-run" > "$work/slurm.sums"
diff "$work/plain.sums" "$work/slurm.sums" || die "slurm left other bytes: logs in $work/slurm-run/runs/experiments/tiny/logs"
say "slurm: the same bytes"
"$hilt" experiment tiny.toml --threads "$threads" 2>&1 > /dev/null | grep -q '0 of .* steps to do' || die "hilt would run steps again that slurm has done"
say "all three ways leave the same $(wc -l < "$work/plain.sums") files"
