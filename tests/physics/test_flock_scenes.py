"""The shipped flocks against a twin of whole scenes, and what they show: a school that gives way, species that part or mix."""

import numpy as np
import pytest

from tests.reference import flight
from warpsim import Scene, Simulation
from warpsim.scene import load_scene
from warpsim.verify.flocks import company
from warpsim.verify.verification import verify_scene

OPEN = np.full(3, np.inf)
