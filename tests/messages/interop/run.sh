#!/bin/sh
# Runs the comparison with node-mavlink: run.sh SOURCE_FOLDER NODE_FOLDER FRAMES_PROGRAM. Exits with 77 (skipped) only
# where node is absent, or where node-mavlink cannot be fetched (no network is no defect of the codec).
set -eu
source_folder=$1 node_folder=$2 program=$3
if ! command -v node > /dev/null || ! command -v npm > /dev/null; then
  echo "skipped: node and npm are not installed"
  exit 77
fi
mkdir -p "$node_folder"
if ! cmp -s "$source_folder/package.json" "$node_folder/installed.json"; then
  cp "$source_folder/package.json" "$node_folder/package.json"
  if ! npm install --no-package-lock --no-audit --no-fund --ignore-scripts --fetch-retries 2 --fetch-timeout 30000 \
      --prefix "$node_folder"; then
    echo "skipped: npm could not fetch node-mavlink"
    exit 77
  fi
  cp "$source_folder/package.json" "$node_folder/installed.json"
fi
for seed in 1 2 3; do
  node "$source_folder/interop.cjs" "$node_folder" "$program" "$seed" 40
done
