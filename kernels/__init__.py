"""Device code: formulas as wp.func, plain kernels, and native loop shapes for the CPU."""

if __name__ != "warpsim.kernels":  # the name `kernels` belongs to another package (docs/adr/0001-packaging.md)
    raise ImportError("import this folder as warpsim.kernels", name=__name__)
