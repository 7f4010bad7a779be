"""The process of an emulated board, `python -m MODULE KIND BAUD PORT`, until its input ends.

It prints where the board is reached: the path of a pseudo-terminal, or socket://HOST:PORT where
PORT is not 0. KIND is "process", or QEMU's machine and the firmware's file with a colon between.
MODULE is the machine's own, and says which firmware a simulated board has.
"""

from __future__ import annotations

import os
import pty
import select
import signal
import socket
import subprocess
import sys
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tactileq.rig.machines.board.virtual import VirtualBoard
from tactileq.rig.shared.wire.transports import SOCKET

HOST = "127.0.0.1"
_INPUT = 0
_LOST = -1


def emulate(compiled: Callable[[], Any]) -> None:
    """Run the board that the arguments name; `compiled` gives the firmware of a simulated one."""
    kind, baud, port = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the input's end is what ends it
    if kind == "process":
        entropy = int.from_bytes(os.urandom(4))
        _run_board(VirtualBoard(compiled(), entropy=entropy, baud=baud), port)
    else:
        machine, firmware = kind.split(":", 1)
        _run_qemu(machine, firmware, port)


def _run_board(board: VirtualBoard, port: int) -> None:
    """Say where it is reached, and let it run until the input ends."""
    if port:
        _serve(board, port)
    else:
        # The other end stays open here: a host that comes and goes is no end of the cable.
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        _say(os.ttyname(theirs))
        board.run(ours, _INPUT)
    board.shut()


def _serve(board: VirtualBoard, port: int) -> None:
    """One host at a time; the board goes on without one."""
    with socket.create_server((HOST, port)) as server:
        _say(f"{SOCKET}{HOST}:{server.getsockname()[1]}")
        while board.run(-1, _INPUT, server.fileno()):
            connection, _ = server.accept()
            with connection:
                connection.setblocking(False)
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                if board.run(connection.fileno(), _INPUT) != _LOST:
                    return


def _run_qemu(machine: str, firmware: str, port: int) -> None:
    serial = f"tcp:{HOST}:{port},server=on,wait=off" if port else "pty"
    command = ["qemu-system-arm", "-M", machine, "-display", "none", "-monitor", "none"]
    command += ["-serial", serial, "-kernel", firmware]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as qemu:
        try:
            assert qemu.stdout is not None
            if port:
                _wait_for(port, qemu)
                _say(f"{SOCKET}{HOST}:{port}")
            else:  # char device redirected to PATH (label …)
                line = qemu.stdout.readline().decode(errors="replace")
                _say(
                    line.split("redirected to ")[1].split()[0] if "redirected to" in line else line
                )
            select.select([_INPUT, qemu.stdout.fileno()], [], [])
        finally:
            qemu.kill()


def _wait_for(port: int, qemu: subprocess.Popen[bytes]) -> None:
    """Until QEMU listens, or has ended."""
    while qemu.poll() is None:
        with suppress(OSError), socket.create_connection((HOST, port), timeout=1.0):
            return
        time.sleep(0.02)


def _say(where: str) -> None:
    sys.stdout.write(f"{where}\n")
    sys.stdout.flush()
