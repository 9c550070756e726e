"""Pictures of the scene, drawn off screen."""

import os
import struct
import zlib
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from shared.errors import SimulationError
from shared.sim.arm import Float64
from shared.sim.model import FencingModel

CAMERA: Final = "audience"
"""The camera that sees both robots, both bats and the target."""


class SceneRenderer:
    """Draws postures of the two robots; one Python thread at a time."""

    def __init__(self, model: FencingModel, width: int = 1280, height: int = 720) -> None:
        """Open an off-screen context (EGL: a GPU or Mesa) of ``width`` x ``height`` pixels.

        Raises:
            SimulationError: if this machine cannot draw.
        """
        self._scene = model.scene
        self._data = mujoco.MjData(self._scene)
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), np.uint8)
        size = self._scene.vis.global_
        size.offwidth, size.offheight = width, height
        self._context = _open_context(width, height)
        self._drawing = mujoco.MjvScene(self._scene, maxgeom=1000)
        self._drawing.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1
        self._drawing.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 1
        self._option = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = self._scene.camera(CAMERA).id
        self._buffers = mujoco.MjrContext(self._scene, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._buffers)

    def draw(self, qpos: Float64) -> NDArray[np.uint8]:
        """Return uint8[height, width, 3], the scene in a posture.

        Args:
            qpos: float64[14], joint angles, antagonist first (rad).
        """
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._scene, self._data)
        mujoco.mj_camlight(self._scene, self._data)
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._scene,
            self._data,
            self._option,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._drawing,
        )
        mujoco.mjr_render(self._rectangle, self._drawing, self._buffers)
        mujoco.mjr_readPixels(self._pixels, None, self._rectangle, self._buffers)
        return np.flipud(self._pixels).copy()

    def close(self) -> None:
        """Give the context back."""
        self._context.make_current()
        self._buffers.free()
        self._context.free()


def _open_context(width: int, height: int) -> Any:
    """Return an EGL context, made current; ``MUJOCO_GL`` is read too early to be of use here."""
    before = os.environ.get("PYOPENGL_PLATFORM")
    os.environ["PYOPENGL_PLATFORM"] = "egl"
    try:
        from mujoco.egl import GLContext

        context = GLContext(width, height)
        context.make_current()
    except Exception as error:  # PyOpenGL raises a different kind on every kind of machine
        raise SimulationError(
            f"cannot draw off screen on this machine ({type(error).__name__}: {error}): install "
            "the packages libegl1, libopengl0 and libgl1-mesa-dri, or draw on another machine"
        ) from error
    finally:
        if before is None:
            del os.environ["PYOPENGL_PLATFORM"]
        else:
            os.environ["PYOPENGL_PLATFORM"] = before
    return context


def save_picture(model: FencingModel, path: Path, width: int = 1600, height: int = 900) -> None:
    """Write a PNG of both robots en garde.

    Raises:
        SimulationError: if this machine cannot draw.
    """
    renderer = SceneRenderer(model, 2 * width, 2 * height)
    try:
        fine = renderer.draw(model.en_garde.ravel())
    finally:
        renderer.close()
    # Drawn at twice the size and averaged: smooth edges on any driver.
    blocks = fine.reshape(height, 2, width, 2, 3).astype(np.uint16)
    path.write_bytes(encode_png((blocks.sum(axis=(1, 3)) // 4).astype(np.uint8)))


def encode_png(pixels: NDArray[np.uint8]) -> bytes:
    """Return uint8[height, width, 3] as the bytes of a PNG file (RFC 2083)."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each row begins with filter 1: "sub"
    rows[:, 0] = 1
    flat = pixels.reshape(height, 3 * width)
    rows[:, 1:4] = flat[:, :3]
    rows[:, 4:] = flat[:, 3:] - flat[:, :-3]
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 9)), (b"IEND", b""))
    body = b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body
