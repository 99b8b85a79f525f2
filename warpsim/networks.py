"""Networks: points, springs and triangles as arrays, laid out from lists, generators or mesh files, and packed for kernels."""

from dataclasses import dataclass, field, replace
from itertools import pairwise, product

import numpy as np

from warpsim.meshes import load_mesh
from warpsim.scene import SceneError
from warpsim.scene.problems import Problem

KINDS = ("structural", "shear", "bend")  # springs of cloth, in their order
SPRING_NUMBERS = ("stiffness", "damping", "rest")  # of a spring, as spring_numbers() returns them
MOST_STEPS = 2  # rows whose neighbors lie in a row are five times as fast: twice as many of them are worth it
SLICE = 64  # points of a slice of the packed springs; kernels/springs.py has the same


@dataclass(frozen=True, eq=False)
class Net:
    """Points at rest and what joins them."""

    points: np.ndarray
    """float64 (n, 3) [m]."""
    springs: np.ndarray
    """int32 (m, 2), places in `points`."""
    triangles: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int32))
    """int32 (k, 3): the surface, if it has one."""
    cells: np.ndarray | None = None
    """int32 (q, 4): the same surface in quadrangles and triangles, which end in −1; None where it is of triangles only."""

    where: str = ""
    """Its place in the scene, for messages."""

    @property
    def facets(self) -> np.ndarray:
        """int32 (q, 4): what of the surface moves as one in a fluid; a triangle's last point is −1."""
        return np.pad(self.triangles, ((0, 0), (0, 1)), constant_values=-1) if self.cells is None else self.cells


def network_of(spec, where: str) -> Net:
    """Return the points, springs and triangles of a `springs` system; `where` is its place in the scene, for messages.

    Raises SceneError for a mesh that cannot be used, or lists that do not fit it.
    """
    if spec.type == "cloth":
        return _cloth(spec)
    if spec.generator is None:
        springs, triangles = np.array(spec.springs, np.int32).reshape(-1, 2), np.array(spec.triangles, np.int32).reshape(-1, 3)
        return Net(np.array(spec.points, float).reshape(-1, 3), springs, triangles, where=where)
    net = replace(_LAYOUTS[spec.generator.type](spec.generator, f"{where}.generator"), where=where)
    _check_lists(spec, net, where)
    return net


def _check_lists(spec, net: Net, where: str) -> None:
    """Raise SceneError where lists and pins do not fit a network whose size only a file tells."""
    wrong = []
    for key, count in (("mass", len(net.points)), *((key, len(net.springs)) for key in ("stiffness", "damping", "rest_length"))):
        value = getattr(spec, key)
        if isinstance(value, tuple) and len(value) != count:
            wrong.append(Problem(f"has {len(value)} values, but the mesh makes {count}", path=f"{where}.{key}"))
    beyond = [pin for pin in spec.pinned(spec.pins) if pin >= len(net.points)]
    if beyond:
        wrong.append(Problem(f"there is no point {beyond[0]}: the mesh makes {len(net.points)}", path=f"{where}.pins"))
    for k, muscle in enumerate(spec.muscles):
        beyond = [n for n in muscle.springs if n >= len(net.springs)] if isinstance(muscle.springs, tuple) else []
        if beyond:
            message = f"there is no spring {beyond[0]}: the mesh makes {len(net.springs)}"
            wrong.append(Problem(message, path=f"{where}.muscles.{k}.springs"))
    if wrong:
        raise SceneError(wrong)


def check_places(spec, net: Net, extent: float, where: str) -> None:
    """Raise SceneError where a point starts beyond the scene's extent [m], or the ends of a spring are one place in 32 bits."""
    source = "corner" if spec.type == "cloth" else "generator" if spec.generator else "points"
    places = net.points.astype(np.float32)
    far = np.flatnonzero(~(np.abs(places) <= extent).all(axis=1))
    if len(far):
        message = f"point {far[0]} starts at {_place(net.points[far[0]])}, beyond limits.extent of {extent:g} m"
        raise _misplaced(message, f"{where}.{source}")
    i, j = net.springs.T
    one = np.flatnonzero((places[i] == places[j]).all(axis=1) & (spring_numbers(spec, net)[2] > 0.0))
    if len(one):
        a, b = i[one[0]], j[one[0]]
        apart = np.linalg.norm(net.points[b] - net.points[a])
        digit = float(np.spacing(np.abs(places[a]).max()))
        message = f"points {a} and {b} lie {apart:.3g} m apart at {_place(net.points[a])}, where 32 bits tell places {digit:.1g} m apart"
        raise _misplaced(f"{message}: nearer to the origin, or larger", f"{where}.{source}")


def _place(point: np.ndarray) -> str:
    return "[" + ", ".join(f"{x:g}" for x in point) + "]"


def _misplaced(message: str, path: str) -> SceneError:
    return SceneError([Problem(message, path=path)])


def spring_numbers(spec, net: Net) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stiffness [N/m], damping [N·s/m] and rest length [m] of every spring, float64 (m,) each."""
    length = np.linalg.norm(net.points[net.springs[:, 1]] - net.points[net.springs[:, 0]], axis=1)
    if spec.type == "cloth":
        nx, ny = spec.resolution
        structural, shear = (nx - 1) * ny + nx * (ny - 1), 2 * (nx - 1) * (ny - 1)
        kinds = np.repeat([0, 1, 2], [structural, shear, len(net.springs) - structural - shear])
        stiffness, damping = (np.array([getattr(getattr(spec, kind), key) for kind in KINDS]) for key in ("stiffness", "damping"))
        return stiffness[kinds], damping[kinds], length
    rest = length if spec.rest_length is None else np.array(spec.rest_length, float)
    return tuple(np.broadcast_to(np.array(value, float), len(net.springs)) for value in (spec.stiffness, spec.damping, rest))


def point_masses(spec, net: Net) -> np.ndarray:
    """Return the mass of every point, float64 (n,) [kg]; of cloth a quarter of each cell round it."""
    if spec.type == "cloth":
        nx, ny = spec.resolution
        cell = np.linalg.norm(np.cross(*(np.array(edge, float) for edge in spec.edges))) / ((nx - 1) * (ny - 1))
        along, down = (np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 0.5, 1.0) for n in (nx, ny))
        return spec.density * cell * np.outer(down, along).reshape(-1)
    return np.array(np.broadcast_to(np.array(spec.mass, float), len(net.points)))


def hinge_numbers(spec) -> tuple[np.ndarray, np.ndarray]:
    """Return k [N/m] and c [N·s/m] of the hinges of cloth along i, along j and across a cell, float64 (3,) each.

    Zero where the cloth has no `bending`; kernels/bending.py says where they are from.
    """
    if spec.type != "cloth" or spec.bending is None:
        return np.zeros(3), np.zeros(3)
    a, b = (np.linalg.norm(edge) / (n - 1) for edge, n in zip(spec.edges, spec.resolution, strict=True))
    weights = np.array([b / a**3, a / b**3, 2.0 / (a * b)])
    return spec.bending.stiffness * weights, spec.bending.damping * weights


def hinge_energy(spec, points: np.ndarray, torn: np.ndarray | None = None) -> float:
    """Return what the hinges of cloth hold at the places (n, 3), Σ ½ k |m|² [J]; `torn` (m,) marks springs beside which there is none."""
    nx, ny = spec.resolution
    stiffness, _ = hinge_numbers(spec)
    x = points.reshape(ny, nx, 3)
    whole = np.ones(spec.spring_count, bool) if torn is None else ~torn
    along = whole[: (nx - 1) * ny].reshape(ny, nx - 1)
    down = whole[along.size :][: nx * (ny - 1)].reshape(ny - 1, nx)
    rows, columns = (np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 0.5, 1.0) for n in (ny, nx))
    folds = ((np.diff(x, 2, axis=1) ** 2).sum(axis=2) * rows[:, None] * along[:, 1:] * along[:, :-1]).sum()
    falls = ((np.diff(x, 2, axis=0) ** 2).sum(axis=2) * columns * down[1:] * down[:-1]).sum()
    twist = np.diff(np.diff(x, axis=0), axis=1)
    turns = ((twist**2).sum(axis=2) * along[1:] * along[:-1] * down[:, 1:] * down[:, :-1]).sum()
    return float(0.5 * stiffness @ [folds, falls, turns])


def _chain(spec, where: str) -> Net:
    share = np.linspace(0.0, 1.0, spec.count)[:, None]
    numbers = np.arange(spec.count - 1)
    return Net((1.0 - share) * spec.start + share * spec.end, np.stack([numbers, numbers + 1], axis=1).astype(np.int32))


def _cloth(spec) -> Net:
    """Return a sheet: its springs are structural, shear, then bend."""
    net = _grid(spec.generator, "")
    number = np.arange(len(net.points)).reshape(spec.resolution[::-1])
    bend = [_joined(number, [step]) for axis, step in ((1, (0, 2)), (0, (2, 0))) if number.shape[axis] > 2]
    return Net(net.points, np.concatenate([net.springs, *bend]), net.triangles)


def _ring(spec, where: str) -> Net:
    normal = np.array(spec.normal, float) / np.linalg.norm(spec.normal)
    across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    across /= np.linalg.norm(across)
    angle = 2.0 * np.pi * np.arange(spec.count)[:, None] / spec.count
    points = np.array(spec.center) + spec.radius * (np.cos(angle) * across + np.sin(angle) * np.cross(normal, across))
    numbers = np.arange(spec.count)
    return Net(points, np.stack([numbers, (numbers + 1) % spec.count], axis=1).astype(np.int32))


def _grid(spec, where: str) -> Net:
    nx, ny = spec.resolution
    number = np.arange(nx * ny).reshape(ny, nx)
    i, j = np.meshgrid(np.linspace(0.0, 1.0, nx), np.linspace(0.0, 1.0, ny))
    along, down = (np.array(edge, float) for edge in spec.edges)
    points = np.array(spec.corner, float) + i[..., None] * along + j[..., None] * down
    return Net(points.reshape(-1, 3), _joined(number, [(0, 1), (1, 0), (1, 1), (1, -1)]), sheet(number))


def _block(spec, where: str) -> Net:
    nx, ny, nz = spec.resolution
    axes = [np.linspace(-0.5, 0.5, n) * size for n, size in zip(spec.resolution, spec.size, strict=True)]
    z, y, x = np.meshgrid(*reversed(axes), indexing="ij")
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3) + spec.center
    number = np.arange(nx * ny * nz).reshape(nz, ny, nx)
    half = [step for step in product((-1, 0, 1), repeat=3) if step > (0, 0, 0)]
    faces = [sheet(number[:, :, 0]), sheet(number[:, :, -1].T), sheet(number[:, 0, :].T), sheet(number[:, -1, :])]
    faces += [sheet(number[0, :, :]), sheet(number[-1, :, :].T)]
    return Net(points, _joined(number, half), np.concatenate(faces))


def _body(spec, where: str) -> Net:
    """Return a body: every section as four corners, of which an edge has two alike and a point all four."""
    head, tail, sections = np.array(spec.head, float), np.array(spec.tail, float), spec.numbers
    axis = (tail - head) / np.linalg.norm(tail - head)
    up = np.array(spec.up, float) - (np.array(spec.up) @ axis) * axis
    up /= np.linalg.norm(up)
    right = np.cross(up, axis)
    forms = {(True, True): (0, 1, 2, 3), (True, False): (0, 1, 1, 0), (False, True): (0, 0, 1, 1), (False, False): (0, 0, 0, 0)}
    places = [forms[one.width > 0.0, one.height > 0.0] for one in spec.sections]
    corners = [[numbers[place] for place in form] for numbers, form in zip(sections, places, strict=True)]
    points = np.zeros((spec.point_count, 3))
    for one, numbers in zip(spec.sections, corners, strict=True):
        for number, (x, y) in zip(numbers, ((1, 1), (-1, 1), (-1, -1), (1, -1)), strict=True):
            points[number] = head + one.at * (tail - head) + 0.5 * (x * one.width * right + y * one.height * up)
    springs, cells = [], []
    for k, numbers in enumerate(sections):
        springs += [(a, b) for n, a in enumerate(numbers) for b in numbers[n + 1 :]]
        after = sections[k + 1] if k + 1 < len(sections) else []
        full = len(numbers) == len(after) == 4
        springs += [(a, b) for n, a in enumerate(numbers) for m, b in enumerate(after) if not full or (m - n) % 4 != 2]
    for here, there in pairwise(corners):
        cells += [(here[n], here[(n + 1) % 4], there[(n + 1) % 4], there[n]) for n in range(4)]
    cells += [tuple(reversed(sections[0])), tuple(sections[-1])]
    whole = [cell for cell in map(_distinct, cells) if len(cell) > 2]
    cut = [half for n, cell in enumerate(whole) for half in _halves(cell, n)]
    rows = [(*cell, -1)[:4] for cell in whole]
    return Net(points, np.array(springs, np.int32), np.array(cut, np.int32), np.array(rows, np.int32))


def _distinct(cell: tuple[int, ...]) -> tuple[int, ...]:
    """Return the corners of a cell without repeated ones."""
    return tuple(dict.fromkeys(cell))


def _halves(cell: tuple[int, ...], n: int) -> list[tuple[int, ...]]:
    """Return the triangles of a cell, cut from corner to corner, every second one along the other diagonal."""
    if len(cell) == 3:
        return [cell]
    a, b, c, d = cell
    return [(a, b, c), (a, c, d)] if n % 2 else [(a, b, d), (b, c, d)]


def _mesh(spec, where: str) -> Net:
    mesh = load_mesh(spec.file.path, f"{where}.file", spec.scale)
    edges = np.sort(np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]]), axis=1)
    points = mesh.vertices.astype(float) + np.array(spec.center)
    return Net(points, np.unique(edges, axis=0).astype(np.int32), mesh.triangles)


_LAYOUTS = {"chain": _chain, "ring": _ring, "grid": _grid, "block": _block, "body": _body, "mesh": _mesh}


def _joined(number: np.ndarray, steps: list[tuple[int, ...]]) -> np.ndarray:
    """Return pairs of the numbers of a grid that lie a step apart, step by step."""
    pairs = []
    for step in steps:
        ends = [number, number]
        for axis, n in enumerate(step):
            here, there = (slice(None, -n), slice(n, None)) if n > 0 else (slice(-n, None), slice(None, n)) if n else (slice(None),) * 2
            place = (slice(None),) * axis
            ends = [ends[0][(*place, here)], ends[1][(*place, there)]]
        pairs.append(np.stack([end.ravel() for end in ends], axis=1))
    return np.concatenate(pairs).astype(np.int32)


def sheet(number: np.ndarray) -> np.ndarray:
    """Return two triangles for every cell of a grid of numbers (rows, columns), its diagonals alternating."""
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    even = (np.add.outer(np.arange(a.shape[0]), np.arange(a.shape[1])) % 2 == 0)[..., None]
    first = np.where(even, np.stack([a, d, c], axis=-1), np.stack([a, d, b], axis=-1))
    second = np.where(even, np.stack([a, c, b], axis=-1), np.stack([b, d, c], axis=-1))
    return np.stack([first, second], axis=2).reshape(-1, 3).astype(np.int32)


def edges_of(net: Net) -> np.ndarray:
    """Return the springs along the three edges of each triangle, int32 (k, 3); −1 where there is none."""
    count = len(net.points)
    number, corners = np.sort(net.springs, axis=1).astype(np.int64), net.triangles.astype(np.int64)
    keys = number[:, 0] * count + number[:, 1]
    order = np.argsort(keys, kind="stable")
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    wanted = ends[..., 0] * count + ends[..., 1]
    if not len(keys):
        return np.full(wanted.shape, -1, np.int32)
    place = np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)
    return np.where(keys[order][place] == wanted, order[place], -1).astype(np.int32)


@dataclass(frozen=True, eq=False)
class Packed:
    """The springs of every point, slice by slice; entry (row, lane) is a spring of point 64·slice + lane, or none."""

    begin: np.ndarray
    """int32 (slices + 1): first row of each slice."""
    neighbor: np.ndarray
    """int32 (rows, 64): the other end; where there is no spring, the point that would go on a row of others, or the point itself."""
    spring: np.ndarray
    """int32 (rows, 64): number of the spring, −1 where there is none."""

    def values(self, per_spring: np.ndarray) -> np.ndarray:
        """Return one value per entry, float32 (rows · 64), from one per spring or one for all; 0 where there is no spring."""
        each = np.append(np.broadcast_to(np.asarray(per_spring, np.float32), self.spring.max(initial=-1) + 1), np.float32(0.0))
        return np.ascontiguousarray(each[self.spring].reshape(-1))

    def places(self) -> np.ndarray:
        """Return the two entries of each spring, int32 (m, 2), as places in arrays of (rows · 64)."""
        flat = self.spring.reshape(-1)
        order = np.argsort(flat, kind="stable")
        return order[np.searchsorted(flat[order], 0) :].reshape(-1, 2).astype(np.int32)


def packed_facets(point_count: int, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the facets (q, 4) of every point, packed as springs are: first rows (slices + 1), and numbers (rows, 64), −1 for none."""
    corner = facets.T.reshape(-1)
    number = np.tile(np.arange(len(facets)), 4)
    begin, (facet,) = _slices(point_count, corner[corner >= 0], number[corner >= 0])
    return begin, facet


def looseness(net: Net, inverse_mass: np.ndarray) -> np.ndarray:
    """Return Σ d/(m N²) over the N corners of each facet, d being how many facets a corner is at, float64 (q,) [1/kg]."""
    corner = net.facets >= 0
    degree = np.bincount(net.facets[corner], minlength=len(net.points))
    loose = np.append(degree * inverse_mass.astype(float), 0.0)[net.facets]  # the last for −1
    return loose.sum(axis=1) / corner.sum(axis=1) ** 2


def packed(point_count: int, springs: np.ndarray) -> Packed:
    """Sort the springs (m, 2) by point into slices of 64 points.

    Where many springs of a slice lead equally far on in the numbering, as in a grid or a block, each row has those: its neighbors lie in a
    row, too. Elsewhere row r has the r-th spring of each point.
    """
    slices = max(1, -(-point_count // SLICE))
    ends, others = springs.T.reshape(-1).astype(np.int64), springs[:, ::-1].T.reshape(-1).astype(np.int64)
    number = np.tile(np.arange(len(springs)), 2)
    order = np.lexsort((number, ends))
    ends, others, number = ends[order], others[order], number[order]
    slice_, step = ends // SLICE, others - ends
    by_turn, width = _turns(ends, slices)
    by_step, step_count = _kinds(slice_, step, slices)
    in_steps = step_count <= MOST_STEPS * width
    begin = np.concatenate([[0], np.cumsum(np.where(in_steps, step_count, width))])
    row = begin[slice_] + np.where(in_steps[slice_], by_step, by_turn)
    steps = np.zeros(begin[-1], np.int64)
    steps[row] = np.where(in_steps[slice_], step, 0)
    own = np.arange(slices * SLICE).reshape(slices, SLICE).repeat(np.diff(begin), axis=0)
    neighbor = own + steps[:, None]
    neighbor = np.where((neighbor >= 0) & (neighbor < slices * SLICE), neighbor, own)
    spring = np.full_like(neighbor, -1)
    neighbor[row, ends % SLICE], spring[row, ends % SLICE] = others, number
    return Packed(begin.astype(np.int32), neighbor.astype(np.int32), spring.astype(np.int32))


def _turns(points: np.ndarray, slices: int) -> tuple[np.ndarray, np.ndarray]:
    """Return of things at points, rising, the how-manieth each is at its point, and the most that a point of each slice has."""
    degree = np.bincount(points, minlength=slices * SLICE)
    return np.arange(len(points)) - np.repeat(np.cumsum(degree) - degree, degree), degree.reshape(slices, SLICE).max(axis=1)


def _kinds(slice_: np.ndarray, value: np.ndarray, slices: int) -> tuple[np.ndarray, np.ndarray]:
    """Return of values in slices the place of each among the different ones of its slice, and how many of those each slice has."""
    pairs, kind = np.unique(np.stack([slice_, value]), axis=1, return_inverse=True)
    count = np.bincount(pairs[0], minlength=slices)
    return kind.reshape(-1) - (np.cumsum(count) - count)[slice_], count


def _slices(point_count: int, points: np.ndarray, numbers: np.ndarray, *more: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Sort numbers of things, and what belongs to them, by the points that they are at, rising, into slices of 64 points."""
    slices = max(1, -(-point_count // SLICE))
    order = np.lexsort((numbers, points))
    points = points[order]
    turn, width = _turns(points, slices)
    begin = np.concatenate([[0], np.cumsum(width)])
    rows = [np.full((begin[-1], SLICE), -1, np.int32) for _ in (numbers, *more)]
    for row, values in zip(rows, (numbers, *more), strict=True):
        row[begin[points // SLICE] + turn, points % SLICE] = values[order]
    return begin.astype(np.int32), rows
