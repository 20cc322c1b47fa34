#!/usr/bin/env bash
# 1. The protocol by hand, as with telnet: each command is a line and has one line as its reply.
#    In one terminal `iiwa-sim`, in another `bash examples/01_telnet.sh 127.0.0.1 30000`.
set -euo pipefail
exec 3<>"/dev/tcp/$1/$2"

say() {
  printf '%s\r\n' "$1" >&3
  IFS= read -r reply <&3
  reply=${reply%$'\r'}
  echo "> $1"
  echo "< $reply"
}

say "hello"
say "get tool frame" # x y z in mm, alpha beta gamma in rad
say "lin move : 450 100 520 0 -1.57079 0 0.5 0"
while say "get status" && [ "$reply" = moving ]; do sleep 0.1; done
say "get tool frame"
say "bye"
