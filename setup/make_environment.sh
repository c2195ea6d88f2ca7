#!/bin/sh
# The virtual environment and the files that name this checkout's folders.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

python=${PYTHON:-python3}
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "Python is $("$python" --version 2>&1); expected 3.11 or newer (set PYTHON=…)." >&2
    exit 1
}
if [ ! -x .venv/bin/python ]; then
    "$python" -m venv .venv || { rm -rf .venv; exit 1; }
fi
.venv/bin/python -m pip install --quiet --disable-pip-version-check \
    --constraint constraints.txt --editable '.[dev]'

mkdir -p .dagster data
cat > .env <<ENV
DAGSTER_HOME=$root/.dagster
TSUYA_DATA=$root/data
ENV
cat > .dagster/dagster.yaml <<'YAML'
# One run of the queue at a time: a run uses all cores of a small machine by itself. What the
# command line runs has no code location: it is beside the queue, and the queue never waits for it.
concurrency:
  runs:
    max_concurrent_runs: -1
    tag_concurrency_limits:
      - key: dagster/code_location
        limit: 1
  pools:
    default_limit: 1
run_monitoring:
  enabled: true
# Ticks are what the schedule and the sensors have noted; days.
retention:
  schedule:
    purge_after_days: 90
  sensor:
    purge_after_days:
      skipped: 1
      failure: 30
      success: 30
telemetry:
  enabled: false
nux:
  enabled: false
YAML
