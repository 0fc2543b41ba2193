"""Cutting a solid into convex pieces, in a process of its own: a surface that crosses itself ends CoACD's by a signal.

CoACD (Wei et al. 2022, ACM Trans. Graph. 41, 42). That process runs this file as it is, without the package.
"""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from haptic_env.arrays import Array

# CoACD's own measure of concavity, and few enough iterations that a ring takes ten seconds; its pieces stick out by 1 %
HOW = {"threshold": 0.02, "mcts_iterations": 40, "preprocess_mode": "off", "seed": 0}
SECONDS = 600.0  # a teapot of 10,000 triangles takes a minute and a half beside other work


def cut(vertices: Array, faces: NDArray[np.int64], seconds: float = SECONDS) -> list[Array]:
    """Cut a closed surface into convex pieces; however this process ends, the one that cuts ends too.

    Args:
        vertices: (V, 3).
        faces: (F, 3).
        seconds: that it may take.

    Returns:
        The corners (M, 3) of each piece.

    Raises:
        ValueError: where it cannot be cut, or not in so many seconds.
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    process = subprocess.Popen(
        [sys.executable, "-P", __file__, str(seconds)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
    )
    late = threading.Event()

    def stop() -> None:
        late.set()
        process.kill()

    watch = threading.Timer(seconds, stop)
    watch.daemon = True
    watch.start()
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        with contextlib.suppress(OSError):  # it ended: what it answered tells
            given = _pack(vertices=vertices, faces=faces)
            process.stdin.write(len(given).to_bytes(8, "little") + given)
            process.stdin.flush()  # left open: the other end sees when this process ends
        answer = process.stdout.read()
        code = process.wait()
    finally:
        watch.cancel()
        process.kill()
        process.wait()
        process.stdout.close()
        with contextlib.suppress(OSError):
            process.stdin.close()
    if late.is_set():
        raise ValueError(f"is not cut into convex pieces in {seconds:g} s: simplify it")
    if code != 0:
        how = f"by signal {-code}" if code < 0 else f"with code {code}"
        raise ValueError(
            f"cannot be cut into convex pieces, CoACD ended {how}: its surface may cross itself, repair it"
        )
    return unpack_pieces(answer)


def pack_pieces(pieces: list[Array]) -> bytes:
    """Make bytes of convex pieces.

    Args:
        pieces: corners (M, 3) of each.

    Returns:
        The bytes.
    """
    return _pack(corners=np.concatenate(pieces), lengths=np.array([len(piece) for piece in pieces]))


def unpack_pieces(data: bytes) -> list[Array]:
    """Make convex pieces of the bytes of `pack_pieces`; an error of whatever kind where they are others.

    Args:
        data: the bytes.

    Returns:
        The corners (M, 3) of each piece.

    Raises:
        ValueError: where they are none.
    """
    told = _unpack(data)
    corners, lengths = told["corners"], told["lengths"]
    if corners.shape != (lengths.sum(), 3) or not np.isfinite(corners).all():
        raise ValueError(f"corners of shape {corners.shape} are none of {len(lengths)} pieces")
    return np.split(corners, np.cumsum(lengths)[:-1])


def _pack(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def _unpack(data: bytes) -> dict[str, NDArray]:
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return dict(arrays)


def _serve(seconds: float) -> None:
    """What the other process does: read a surface, write its pieces, end when nobody waits for them."""
    size = int.from_bytes(sys.stdin.buffer.read(8), "little")
    told = _unpack(sys.stdin.buffer.read(size))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    limit = threading.Timer(seconds + 60, os._exit, [1])  # where a fork of the parent keeps the pipe open
    limit.daemon = True
    limit.start()
    answer = os.dup(1)
    os.dup2(2, 1)  # what CoACD prints is no answer

    import coacd

    coacd.set_log_level("error")
    pieces = [corners for corners, _ in coacd.run_coacd(coacd.Mesh(told["vertices"], told["faces"]), **HOW)]
    with os.fdopen(answer, "wb") as stream:
        stream.write(pack_pieces(pieces))
    os._exit(0)


def _end_with_parent() -> None:
    while os.read(0, 1):
        pass
    os._exit(1)


if __name__ == "__main__":
    _serve(float(sys.argv[1]))
