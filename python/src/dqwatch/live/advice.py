"""What to do where a fault was named: docs/INTEGRATION.md has the same."""

from __future__ import annotations

ADVICE = {
    "over_temperature": "Derate; cross-check the temperature sensor.",
    "demagnetisation": "Torque per ampere has fallen: limit the current, plan a change of motor.",
    "turn_short": "Stop: shorted turns grow within minutes.",
    "phase_connection": "Tighten or replace the connector before it heats.",
    "current_offset": "Calibrate the current sensor anew; torque ripples until then.",
    "current_gain": "Calibrate the current sensor anew; torque ripples until then.",
    "encoder_offset": "Align the encoder anew.",
    "bearing_wear": "Plan maintenance.",
    "inverter_fault": "Check gate drive, bootstrap and switches.",
    "resistance_rise": "Check the cable, the connector at the inverter, the switches.",
    "voltage_scale": "Check the measurement of the link's voltage.",
    "unknown": "No pattern fits: trace the minute around it.",
}


def advice(fault: str) -> str:
    """What to do, in one sentence."""
    return ADVICE.get(fault, ADVICE["unknown"])
