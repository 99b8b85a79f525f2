"""Colors: four bytes, red, green, blue and opacity, in one word."""

import warp as wp

WHITE = wp.constant(wp.uint32(0xFFFFFFFF))


@wp.func
def multiply_bytes(a: wp.uint32, b: wp.uint32, shift: wp.uint32) -> wp.uint32:
    """Return the byte a b/255, rounded, in its place; both read at `shift` bits."""
    mask = wp.uint32(255)
    product = ((a >> shift) & mask) * ((b >> shift) & mask)
    return ((product + wp.uint32(127)) / mask) << shift


@wp.func
def multiply_colors(a: wp.uint32, b: wp.uint32) -> wp.uint32:
    """Return the color a b, channel by channel; white changes nothing."""
    rg = multiply_bytes(a, b, wp.uint32(0)) | multiply_bytes(a, b, wp.uint32(8))
    return rg | multiply_bytes(a, b, wp.uint32(16)) | multiply_bytes(a, b, wp.uint32(24))
