#!/usr/bin/env bash
# What the job through a real kernel needs, unpacked into a folder without installing anything (Debian, Ubuntu):
#   tests/devices/kernel/fetch.sh FOLDER
#   PALPATE_KERNEL_TOOLS=FOLDER python -m pytest -m kernel tests/devices
set -euo pipefail
folder=$(mkdir -p "$1" && cd "$1" && pwd)
packages=$(mktemp -d)
trap 'rm -rf "$packages"' EXIT
cd "$packages"
kernel=$(apt-cache search --names-only '^linux-image-[0-9.-]+-amd64$' | awk '{print $1}' | sort -V | tail -1)
missing=$(apt-get install -s --no-install-recommends qemu-system-x86 | awk '/^Inst/ {print $2}')
apt-get download busybox-static "$kernel" $missing
for package in *.deb; do dpkg -x "$package" "$folder"; done
