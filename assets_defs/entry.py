"""What ``dagster dev -w workspace.yaml`` loads."""

from assets_defs.definitions import build_definitions

definitions = build_definitions()
