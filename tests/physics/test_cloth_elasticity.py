"""Cloth as a continuum: C11 = k_s + k_d + 4 k_b, C12 = C66 = k_d, in every direction, on square cells and others, and what is isotropic."""

import math

import numpy as np
import pytest

from tests.physics.test_cloth_laws import put
from tests.simulation.networks import simulate, state

SPACING, STRAIN = 0.1, 2e-3


def sheet(n: int, k_s: float, k_d: float, k_b: float, angle: float = 0.0, down: float = SPACING) -> dict:
    """Keys of n × n points whose rows run at an angle in the plane, cells of SPACING by `down`."""
    along, across = np.array([math.cos(angle), math.sin(angle), 0.0]), np.array([math.sin(angle), -math.cos(angle), 0.0])
    edges = [(SPACING * (n - 1) * along).tolist(), (down * (n - 1) * across).tolist()]
    kinds = {kind: {"stiffness": k} for kind, k in (("structural", k_s), ("shear", k_d), ("bend", k_b))}
    return {"type": "cloth", "resolution": [n, n], "edges": edges, "density": 0.4, **kinds}


def stress(gradient: np.ndarray, n: int, **keys) -> np.ndarray:
    """Mean stress Σ F xᵀ of a sheet that is strained all over [N m], from the impulse of one short substep of either sign."""
    total = np.zeros((3, 3))
    for sign in (1, -1):
        sim = simulate(**sheet(n, **keys), fps=1e4, substeps=1)
        home, _ = state(sim)
        put(sim, home @ (np.eye(3) + sign * STRAIN * gradient).T)
        sim.step_frame()
        force = sim.frame()["s"].mass.astype(float)[:, None] * state(sim)[1] * 1e4
        total -= sign * force.T @ home / (2 * STRAIN)
    return total


def moduli(gradient: np.ndarray, **keys) -> np.ndarray:
    """Stress per strain of the inside [N/m]: of three sizes the part that grows with the area, free of rims and corners."""
    sizes = (8, 12, 16)
    virial = np.array([stress(gradient, n, **keys) for n in sizes])
    cells = np.array([n - 1.0 for n in sizes])
    per_cell = np.linalg.solve(np.stack([cells**2, cells, np.ones(3)], axis=1), virial.reshape(3, -1))[0].reshape(3, 3)
    return per_cell / (SPACING * keys.get("down", SPACING))


STRETCH, WIDEN, SHEAR = np.diag([1.0, 0, 0]), np.diag([0, 1.0, 0]), np.array([[0, 0.5, 0], [0.5, 0, 0], [0, 0, 0]])


@pytest.mark.parametrize(("k_s", "k_d", "k_b"), [(40.0, 24.0, 3.0), (10.0, 50.0, 0.0), (0.0, 5.0, 20.0)])
def test_the_moduli_of_square_cells(k_s, k_d, k_b):
    """Asked for: 1 %; springs under strains of 2e-3 of either sign leave 1e-5, roundings of velocities 1e-3."""
    k = {"k_s": k_s, "k_d": k_d, "k_b": k_b}
    stretched, widened, sheared = (moduli(gradient, **k) for gradient in (STRETCH, WIDEN, SHEAR))
    stiff, floor = k_s + k_d + 4 * k_b, 0.01 * (k_s + k_d + k_b)
    assert stretched[0, 0] == pytest.approx(stiff, rel=0.01) and widened[1, 1] == pytest.approx(stiff, rel=0.01)
    assert stretched[1, 1] == pytest.approx(k_d, rel=0.01) and widened[0, 0] == pytest.approx(k_d, rel=0.01)
    assert sheared[0, 1] == pytest.approx(k_d, rel=0.01) and sheared[1, 0] == pytest.approx(k_d, rel=0.01)
    assert max(abs(stretched[0, 1]), abs(widened[0, 1]), abs(sheared[0, 0])) < floor, "stretching does not shear"


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0])
@pytest.mark.parametrize(("k_b", "isotropic"), [(3.0, True), (12.0, False)])
def test_a_sheet_is_isotropic_iff_its_springs_balance(angle, k_b, isotropic):
    """C11 is the same in every direction iff C11 − C12 = 2 C66, which is k_s + 4 k_b = 2 k_d; else it follows the rows' angle."""
    k_s, k_d = 20.0, 16.0
    c11, c12 = k_s + k_d + 4 * k_b, k_d
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    turned = c11 * (c**4 + s**4) + 2 * (c12 + 2 * k_d) * (c * s) ** 2
    measured = moduli(STRETCH, k_s=k_s, k_d=k_d, k_b=k_b, angle=math.radians(angle))[0, 0]
    assert measured == pytest.approx(turned, rel=0.01)
    assert (measured == pytest.approx(c11, rel=0.01)) == (isotropic or angle == 0.0)


def test_the_moduli_of_oblong_cells():
    """Cells a × b: each kind of springs adds k l² n̂n̂n̂n̂ over the cell's area, Σ k (d_i d_j d_k d_l)/(l² a b)."""
    k_s, k_d, k_b, a, b = 40.0, 24.0, 3.0, SPACING, 0.16
    steps = [(k_s, a, 0), (k_s, 0, b), (k_d, a, b), (k_d, a, -b), (k_b, 2 * a, 0), (k_b, 0, 2 * b)]

    def modulus(p: int, q: int) -> float:
        return sum(k * x**p * y**q / (x * x + y * y) for k, x, y in steps) / (a * b)

    measured = [moduli(gradient, k_s=k_s, k_d=k_d, k_b=k_b, down=b) for gradient in (STRETCH, WIDEN, SHEAR)]
    assert measured[0][0, 0] == pytest.approx(modulus(4, 0), rel=0.01)
    assert measured[1][1, 1] == pytest.approx(modulus(0, 4), rel=0.01)
    assert measured[0][1, 1] == pytest.approx(modulus(2, 2), rel=0.01)
    assert measured[2][0, 1] == pytest.approx(modulus(2, 2), rel=0.01)
