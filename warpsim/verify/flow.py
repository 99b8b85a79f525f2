"""Measurers of the flow: the probes of warpsim/probes.py at the oracle's place and moment."""

from abc import abstractmethod

import numpy as np

from warpsim.verify.amounts import expected_at
from warpsim.verify.findings import Quantity, Reading
from warpsim.verify.measurers import FlowMeasurer


class _Probed(FlowMeasurer):
    """Measures one quantity at the oracle's moment."""

    _measured: Quantity

    def probe(self, flow) -> None:
        self._measured = self.measure(flow, self.oracle)

    @abstractmethod
    def measure(self, flow, oracle) -> Quantity:
        """Return the quantity."""

    def reading(self) -> Reading:
        return Reading(self._measured, expected_at(self.oracle.expect, self.oracle.at), remark=self.remark())

    def remark(self) -> str:
        """Return why there is no number, where there is none."""
        return ""


class VelocityMeasurer(_Probed):
    """v at a point."""

    def measure(self, flow, oracle) -> np.ndarray:
        return flow.sample([oracle.point], oracle.at)[0].astype(float)


class CurlMeasurer(_Probed):
    """curl v at a point, by fourth-order differences."""

    def measure(self, flow, oracle) -> np.ndarray:
        return flow.curl([oracle.point], oracle.at, oracle.spacing)[0]


class DivergenceMeasurer(_Probed):
    """div v at a point, by fourth-order differences."""

    def measure(self, flow, oracle) -> float:
        return float(flow.divergence([oracle.point], oracle.at, oracle.spacing)[0])


class CirculationMeasurer(_Probed):
    """∮ v·ds round a circle."""

    def measure(self, flow, oracle) -> float:
        return flow.circulation(oracle.center, oracle.axis, oracle.radius, oracle.at)


class FluxMeasurer(_Probed):
    """∮ v·n through a cylinder of unit length, or through a sphere."""

    def measure(self, flow, oracle) -> float:
        return flow.flux(oracle.center, oracle.axis, oracle.radius, oracle.at)


class DischargeMeasurer(_Probed):
    """∫ v·dA through a disc."""

    def measure(self, flow, oracle) -> float:
        return flow.discharge(oracle.center, oracle.axis, oracle.radius, oracle.at)


class PressureForceMeasurer(_Probed):
    """−∮ p n ds round a cylinder, by Bernoulli."""

    def measure(self, flow, oracle) -> np.ndarray:
        return flow.pressure_force(oracle.center, oracle.axis, oracle.radius, oracle.density, oracle.at)


class StreamlineMeasurer(_Probed):
    """Where a streamline ends; on a plane by the chord between the two points beside it."""

    def measure(self, flow, oracle) -> np.ndarray:
        line = flow.streamlines([oracle.start], oracle.length, oracle.steps, oracle.at)[0].astype(float)
        if oracle.plane is None:
            return line[-1]
        side = (line - np.array(oracle.plane)) @ (np.array(oracle.normal) / np.linalg.norm(oracle.normal))
        crossings = np.flatnonzero(side[:-1] * side[1:] <= 0.0)
        if not len(crossings):
            return np.full(3, np.nan)
        k = crossings[0]
        share = side[k] / (side[k] - side[k + 1]) if side[k] != side[k + 1] else 0.0
        return line[k] + share * (line[k + 1] - line[k])

    def remark(self) -> str:
        if np.isfinite(self._measured).all():
            return ""
        return (
            "the flow is not finite on its way"
            if self.oracle.plane is None
            else f"it does not cross the plane within {self.oracle.length:g} m"
        )
