#!/usr/bin/env bash
# What the stages of `make all` have left in RUN (runs/TASK), and whether it is still what they left.
#
#   made.sh RUN METHOD stale COMMAND...         the stages that must run again; why, on stderr
#   made.sh RUN METHOD start STAGE COMMAND...   before a stage: keeps its settings
#   made.sh RUN METHOD done STAGE               after it has succeeded: its settings and sizes become settings/STAGE.toml
#   made.sh RUN METHOD result                   one line: what stands
#   made.sh RUN METHOD clean                    removes what make made, and nothing else
#
# COMMAND with `--stage STAGE` prints a stage's settings. Sizes are compared, not hashes: a `make all` that has nothing to do reads no
# gigabytes. Damage that leaves the size as it is, is found by the stage that reads the file. `hilt inspect RUN` goes by the same notes
# (src/report/runs/stamp.rs).
set -u -o pipefail
shopt -s nullglob
export LC_ALL=C

run=$1 method=$2 what=$3
shift 3
of=${method#hil}
of=${of:+-$of}
here=$PWD
stages="plan simulate convert pretrain train evaluate"
# Between a stage's settings and the sizes of its files.
sizes_follow='# bytes left in place:'

say() { echo "make: $*" >&2; }

# The files that a stage leaves, one a line. Hidden and foreign ones are none of them.
files_of() {
    case $1 in
        plan) set -- plans.parquet ;;
        simulate) set -- recordings/episode-*.mcap ;;
        convert) set -- dataset/{train,validation}/{meta/{info.json,stats.json,tasks.parquet},{data,meta/episodes}/chunk-*/*.parquet} ;;
        pretrain) set -- dynamics.safetensors dynamics.*.parquet ;;
        train) set -- "policy$of.safetensors" "policy$of".*.parquet ;;
        evaluate) set -- "evaluation$of.json" "evaluation$of".*.parquet ;;
    esac
    [ $# -eq 0 ] || printf '%s\n' "$@"
}

artefact_of() {
    case $1 in
        plan) echo plans.parquet ;;
        simulate) echo recordings ;;
        convert) echo dataset ;;
        pretrain) echo dynamics.safetensors ;;
        train) echo "policy$of.safetensors" ;;
        evaluate) echo "evaluation$of.json" ;;
    esac
}

stage_before() {
    case $1 in
        simulate) echo plan ;;
        convert) echo simulate ;;
        pretrain) echo convert ;;
        train) case $method in ppo) ;; bc-rl) echo convert ;; *) echo pretrain ;; esac ;;
        evaluate) echo train ;;
    esac
}

# A stage with the method in its name, where a method has files of its own.
name_of() { case $1 in train | evaluate) echo "$1$of" ;; *) echo "$1" ;; esac; }
stamp_of() { echo "settings/$(name_of "$1").toml"; }
# The settings of a stage that has begun; it becomes the stamp when the stage has succeeded.
begun_of() { echo "settings/.$(name_of "$1").begun"; }

sizes_of() {
    echo "$sizes_follow"
    files_of "$1" | tr '\n' '\0' | xargs -0 wc -c 2> /dev/null | sed -e '/ total$/d' -e 's/^ */# /'
}

# Whether a stage wrote a file since another file was written.
wrote_since() {
    local file
    while read -r file; do
        [ -e "$file" ] && ! [ "$file" -ot "$2" ] && return 0
    done < <(files_of "$1")
    return 1
}

any_newer() {
    local file
    while read -r file; do
        [ "$file" -nt "$2" ] && return 0
    done < <(files_of "$1")
    return 1
}

# Prints the stage if it must run again. Its settings come as the second argument.
check() {
    local stage=$1 settings=$2 stamp begun before was now artefact why=
    stamp=$(stamp_of "$stage") begun=$(begun_of "$stage") before=$(stage_before "$stage") artefact=$(artefact_of "$stage")
    if ! [ -e "$stamp" ]; then
        name_of "$stage"
        return
    fi
    was=$(cat "$stamp")
    now=$settings$'\n'$(sizes_of "$stage")
    if [ -e "$begun" ] && wrote_since "$stage" "$begun"; then
        why="it was stopped while it put $run/$artefact in place"
    elif [ "$settings" != "${was%%$'\n'"$sizes_follow"*}" ]; then
        why="the settings of $run/$artefact have changed"
    elif [ "$now" != "$was" ] && ! another_whole "$was" "$now"; then
        why="$run/$artefact is missing or damaged, or a file in it is"
    elif [ -n "$before" ] && any_newer "$before" "$stamp"; then
        why="$run/$(artefact_of "$before") was changed by hand"
    elif [ "$now" != "$was" ]; then
        say "$run/$artefact is whole, but not the one that $stage left there: it is kept"
    fi
    if [ -n "$why" ]; then
        say "$stage runs again: $why"
        name_of "$stage"
    fi
}

# Whether all files that are not as a stage left them are whole, so that somebody put them there on purpose, rather than what is left of
# make's own.
another_whole() {
    local others file
    others=$(grep -vxFf <(echo "$1") <(echo "$2") | sed -e 's/^# [0-9]* //' -e 's|^dataset/.*|dataset|' | sort -u)
    [ -n "$others" ] || return 1
    while read -r file; do
        "$hilt" inspect "$file" > /dev/null 2>&1 || return 1
    done <<< "$others"
}

stale() {
    local stage settings
    hilt=$1
    [[ $hilt == /* ]] || hilt=$here/$hilt
    for stage in $stages; do
        if settings=$("$@" --stage "$stage") && cd "$run" 2> /dev/null; then check "$stage" "$settings"; else name_of "$stage"; fi &
    done
    wait
}

begin() {
    local stage=$1 begun=$run/$(begun_of "$1")
    shift
    mkdir -p "$run/settings" && "$@" --stage "$stage" > "$begun"
}

finish() {
    cd "$run" || exit
    local stamp begun
    stamp=$(stamp_of "$1") begun=$(begun_of "$1")
    # Another make that ran beside this one may have been here first.
    if ! [ -e "$begun" ] && [ -e "$stamp" ]; then return; fi
    sizes_of "$1" >> "$begun" && mv -f "$begun" "$stamp"
}

# Every stage has ended well: what was begun once, with other settings, and never ended is of no interest any more.
result() {
    local stage evaluation=$run/evaluation$of.json
    for stage in $stages; do rm -f "$run/$(begun_of "$stage")"; done
    sed -n -e 's/^  "successes": \([0-9]*\),*$/s \1/p' -e 's/^  "episodes": \([0-9]*\),*$/e \1/p' "$evaluation" |
        awk -v task="${run##*/}" -v method="$method" -v policy="$run/policy$of.safetensors" -v evaluation="$evaluation" '
            { n[$1] = $2 }
            END { printf "%s by %s: success %d of %d (%.1f %%), policy %s, evaluation %s\n",
                      task, method, n["s"], n["e"], n["e"] ? 100 * n["s"] / n["e"] : 0, policy, evaluation }'
}

# By name, so that nothing foreign goes; a directory goes when nothing is left in it. Some names are those of earlier versions.
clean() {
    [ -d "$run" ] || return 0
    cd "$run" || exit
    local of method
    for method in '' -bc -sc -ppo -bc-rl; do
        rm -f "policy$method".{safetensors,checkpoint.safetensors,training.parquet,training.jsonl} "evaluation$method".{json,parquet,episodes.parquet}
    done
    rm -f plans.parquet dynamics.{safetensors,parquet,errors.parquet,pretraining.parquet,pretraining.jsonl} {pre,}training.parquet episode-00000.png
    rm -rf {plans,recordings}.unfinished/{run-*,.hilt-*}
    rm -f recordings/episode-*.mcap logs/{plan,simulate,convert,pretrain,train{,-bc,-sc,-ppo,-bc-rl},evaluate{,-bc,-sc,-ppo,-bc-rl}}.log
    rm -f dataset/{train,validation}/{meta/{info.json,stats.json,tasks.parquet},{data,meta/episodes}/chunk-*/file-*.parquet}
    rm -f settings/{,.}{plan,simulate,convert,pretrain,train{,-bc,-sc,-ppo,-bc-rl},evaluate{,-bc,-sc,-ppo,-bc-rl}}.{toml,begun}
    rm -rf .hilt-* {dataset,recordings,settings}/.hilt-*
    rm -f {.,settings,logs,recordings,{plans,recordings}.unfinished,dataset,dataset/*,dataset/*/{data,meta},dataset/*/{data,meta/episodes}/chunk-*}/{.DS_Store,.directory,Thumbs.db}
    find recordings {plans,recordings}.unfinished dataset settings logs -depth -type d -exec rmdir {} + 2> /dev/null
    cd "$here" && rmdir "$run" 2> /dev/null
    [ ! -e "$run" ] || say "$run stays, with what make did not make: $(cd "$run" && find . ! -type d | sed 's|^\./||' | sort | head -n 5 | tr '\n' ' ')"
}

case $what in
    stale) stale "$@" ;;
    start) begin "$@" ;;
    done) finish "$@" ;;
    result) result ;;
    clean) clean ;;
esac
