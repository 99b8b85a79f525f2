"""Which measurer measures which oracle. A new kind is its spec in warpsim/scene, its measurer in this room, and a line here."""

from warpsim.scene.springs import Network
from warpsim.verify import births, contact, flocks, flow, motion, networks, orders, systems
from warpsim.verify.measurers import Measurer

MEASURERS: dict[str, type[Measurer]] = {
    "velocity": flow.VelocityMeasurer,
    "curl": flow.CurlMeasurer,
    "divergence": flow.DivergenceMeasurer,
    "circulation": flow.CirculationMeasurer,
    "flux": flow.FluxMeasurer,
    "discharge": flow.DischargeMeasurer,
    "pressure_force": flow.PressureForceMeasurer,
    "streamline": flow.StreamlineMeasurer,
    "terminal_speed": motion.TerminalSpeedMeasurer,
    "relaxation": motion.RelaxationMeasurer,
    "arc": motion.ArcMeasurer,
    "orbit": motion.OrbitMeasurer,
    "bounce_height": motion.BounceHeightMeasurer,
    "position": motion.PositionMeasurer,
    "energy": motion.EnergyMeasurer,
    "momentum": motion.MomentumMeasurer,
    "emission_mean": births.MeanCountMeasurer,
    "emission_variance": births.CountVarianceMeasurer,
    "uniformity": births.UniformityMeasurer,
    "live_count": systems.LiveCountMeasurer,
    "size": systems.SizeMeasurer,
    "convergence_order": orders.ConvergenceOrderMeasurer,
    "hash": systems.HashMeasurer,
    "place": networks.PlaceMeasurer,
    "period": networks.PeriodMeasurer,
    "clearance": contact.ClearanceMeasurer,
    "crossings": contact.CrossingsMeasurer,
    "amplitude": networks.AmplitudeMeasurer,
    "reach": networks.ReachMeasurer,
    "rms_speed": networks.RmsSpeedMeasurer,
    "agreement": networks.AgreementMeasurer,
    "order": flocks.OrderMeasurer,
    "presence": flocks.PresenceMeasurer,
}

TOGETHER: dict[str, type[Measurer]] = {
    "position": systems.CentroidMeasurer,
    "energy": systems.TotalEnergyMeasurer,
    "momentum": systems.TotalMomentumMeasurer,
}
"""Of a system's particles together, for the kinds that have `of: system`."""

OF_NETWORKS: dict[str, type[Measurer]] = {
    **TOGETHER,
    "position": networks.CenterMeasurer,
    "energy": networks.NetworkEnergyMeasurer,
}
"""Of a network's points together."""

OF_VALUES: dict[str, type[Measurer]] = {
    "emission_mean": births.MeanValueMeasurer,
    "emission_variance": births.ValueVarianceMeasurer,
}
"""Of an initial value, for the kinds that count births otherwise."""


def measurer_of(oracle, scene) -> Measurer:
    """Return the measurer of an oracle."""
    of = getattr(oracle, "of", None)
    together = OF_NETWORKS if isinstance(scene.systems.get(getattr(oracle, "system", None)), Network) else TOGETHER
    kinds = together if of == "system" else OF_VALUES if oracle.type in OF_VALUES and of != "count" else MEASURERS
    return kinds[oracle.type](oracle, scene)
