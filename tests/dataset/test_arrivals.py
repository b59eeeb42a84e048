import numpy as np
import torch

from avn.acoustics.settings import AcousticsConfig
from avn.dataset.arrivals import arrivals
from avn.dataset.source_locations import locate_sources
