"""What a page holds, read back from a browser."""

import io

import numpy as np
from PIL import Image


def read_positions(page) -> np.ndarray:
    """Return the places [m] that the first cloud's buffers hold, as the shader works them out, (n, 3)."""
    script = """(() => {
        const cloud = stream.clouds[0], a = cloud.points.geometry.attributes.position, u = cloud.points.material.uniforms;
        return {raw: Array.from(a.array.slice(0, 4 * cloud.count)), extent: u.extent.value.toArray(), origin: u.origin.value.toArray()};
    })()"""
    held = page.run(script)
    raw = np.array(held["raw"], float).reshape(-1, 4)[:, :3]
    return raw / 65535 * held["extent"] + held["origin"]


def picture(page) -> np.ndarray:
    """Return what the page shows, (height, width, 3) in 0..255."""
    return np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(int)
