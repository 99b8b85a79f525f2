"""A frame of the run as the blocks of a frame on the wire."""

import numpy as np

from warpsim.observers.viewer.protocol import Attribute, Block


def frame_blocks(frame, names: list[str], limit: int | None) -> list[Block]:
    """Return the blocks of a frame: of the systems `names`, number n in slot n, each about `limit` points, and the colliders'."""
    blocks: list[Block] = []
    for slot, name in enumerate(names):
        blocks += cloud_blocks(slot, frame[name], limit)
    if len(poses := frame.collider_poses):
        blocks.append(Block(len(names), Attribute.POSES, poses))
    return blocks


def cloud_blocks(slot: int, system, limit: int | None) -> list[Block]:
    """Return the blocks of one system's points; positions are 16 bits a component in the box of the cloud."""
    cloud = system.packed(None if system.is_network else limit)  # what joins its points counts on all of them
    # The page sees a normalized component as 0..1, so its scale is the whole box, not one step of it.
    box = (np.asarray(cloud.scale, np.float32) * np.float32(65535.0), cloud.offset)
    blocks = [
        Block(slot, Attribute.POSITION, cloud.position[: cloud.count], normalized=True, affine=box),
        Block(slot, Attribute.COLOR, cloud.color[: cloud.count], normalized=True),
        Block(slot, Attribute.SIZE_MAX, np.array([cloud.size_max], np.float32)),
        Block(slot, Attribute.LIVE_COUNT, np.array([system.count], np.uint32)),
    ]
    heading = getattr(cloud, "heading", None)
    if heading is not None:
        blocks.append(Block(slot, Attribute.HEADING, heading[: cloud.count], normalized=True))
    trail = getattr(cloud, "trail", None)
    if trail is not None:
        blocks += [
            Block(slot, Attribute.TRAIL, trail.reshape(-1, 4), normalized=True, affine=box),
            Block(slot, Attribute.TRAIL_COLOR, cloud.trail_color, normalized=True),
            Block(slot, Attribute.TRAIL_POINTS, np.array([trail.shape[1]], np.uint32)),
        ]
    return blocks + tear_blocks(slot, system)


def tear_blocks(slot: int, system) -> list[Block]:
    """Return what of a network is torn: in every frame, so that no frame that a page leaves out or goes back over matters."""
    if not system.tears:
        return []
    kinds = {Attribute.TORN: system.torn, Attribute.LOST: system.lost}
    return [Block(slot, kind, np.packbits(gone, bitorder="little")) for kind, gone in kinds.items()]
