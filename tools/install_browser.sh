#!/bin/sh
# Installs a headless browser for the tests of pages, where there is none and this user may.
for name in chromium chromium-browser google-chrome google-chrome-stable; do
  command -v "$name" >/dev/null && exit 0
done
if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
  echo "no browser, and none can be installed here: the tests that open pages are skipped" >&2
  exit 0
fi
apt-get update -qq &&
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    chromium fonts-dejavu-core >/dev/null ||
  echo "no browser could be installed: the tests that open pages are skipped" >&2
