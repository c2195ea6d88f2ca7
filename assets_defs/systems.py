"""All systems with everything that they declare, by name. Importing this imports no Dagster."""

from assets_defs.glass_scratches.graph import SCRATCHES
from assets_defs.neural_btf.graph import BTF
from assets_defs.photo_fur.graph import FUR
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.street_billboards.graph import STREET
from assets_defs.system import System

SYSTEMS: dict[str, System] = {system.name: system for system in (FUR, BTF, SCRATCHES, SSDF, STREET)}
