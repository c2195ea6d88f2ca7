"""Instruments that need no capture: what they measure is known exactly."""
