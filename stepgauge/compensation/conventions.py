"""What controls do with the values of their tables, after the maker's manual or the source code of the firmware.

Every format that is written stands here with its sign, unit, zero and activation, and where that was read. The virtual
controls of the tests are written from these sentences, not from the templates.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Convention:
    """How a control understands a table; error = indicated minus true coordinate of the axis.

    ``value``: what is written, with its unit; ``applied``: what the control does with it; ``needs``: what must be set,
    and what is taken for granted of the machine; ``source``: where it was read; ``unconfirmed``: what no source says.
    """

    value: str
    applied: str
    needs: str
    source: str
    unconfirmed: str = ""


_K3 = "SINUMERIK 840D sl, Function Manual Extended Functions, 01/2008 and 03/2013, K3"
_FANUC = Convention(
    "change of the error from the point below to this one, in pulses of the least input increment times 3623",
    "pulses are summed from the point of the reference position (3620); a positive sum sends the axis farther in"
    " positive direction. A pulse belongs to the section below its point",
    "reference position return in positive direction (3627 is the compensation at the reference position in travel"
    " against it), point 3620 at the reference position; for both directions the option and 3605 bit 0 set; power off"
    " and on, then reference position return",
    "Fanuc 0i parameter manual B-63980EN, pages 99 and 100 (points, sections, sum); technical report A-77810E (both"
    " directions)",
    "the sense of the pulses (it is that of Mitsubishi: interval minus actual movement)",
)
_STEPS = "steps per mm times the factor: every command is stretched by it from machine zero"
CONVENTIONS = {
    "linuxcnc": Convention(
        "mm; type 0: true position of the joint at the nominal one, that is nominal minus error; type 1: the error;"
        " columns nominal, forward, reverse",
        "trim = nominal minus value (type 0) or value (type 1), linear between rows, of the column of the direction of"
        " travel; it is added to the command of the motor and taken off its feedback",
        "[JOINT_n] COMP_FILE and COMP_FILE_TYPE; LINEAR_UNITS = mm; joint homed; BACKLASH has no effect beside it",
        "LinuxCNC 2.9, src/emc/motion/control.c (compute_screw_comp), usrmotintf.cc (usrmotLoadComp); both types were"
        " run on LinuxCNC",
    ),
    "siemens": Convention(
        "mm, minus the error",
        "the value is added to what the encoder reads; a positive value moves the axis in negative direction",
        "MD38000 holds the points; loaded while MD32700 = 0; then MD32700 = 1; axis referenced with this measuring"
        " system",
        f"{_K3}, measuring system error compensation, $AA_ENC_COMP",
    ),
    "siemens-cec": Convention(
        "mm, minus the error",
        "a positive value moves the axis in negative direction, as with $AA_ENC_COMP; the input is the setpoint of the"
        " axis; $AN_CEC_DIRECTION 1, -1: in positive, negative travel only",
        "MD18342 holds the points; loaded while MD32710 = 0; then SD41300 $SN_CEC_TABLE_ENABLE and MD32710 = 1;"
        " MD32711 = 1 (metric); MD32720 at least the largest value; axis referenced; no other table onto this axis",
        f"{_K3}, compensation of sag and angularity errors, $AN_CEC",
    ),
    "heidenhain": Convention(
        "mm, minus the error; BACKLASH for travel in negative direction",
        "the value is added to what the scale reads, linear between rows; AXISPOS from the machine datum",
        "file named for the axis in the active line of CONFIG.CMA; non-linear compensation chosen (MP730, or"
        " CfgAxisComp); machine datum as in the recording",
        "Technical Manuals TNC 407, page 4-28, and MANUALplus 620, pages 713 to 718",
        "the sense of the values (it is that of the linear compensation, TNC 407 MP720: positive where the table"
        " travels too far)",
    ),
    "fanuc": _FANUC,
    "fanuc-g10": Convention(
        _FANUC.value,
        _FANUC.applied,
        _FANUC.needs + "; writing of parameters enabled",
        _FANUC.source + "; form of G10 L50 as in a user's postprocessor",
        _FANUC.unconfirmed + "; 10000 plus the point as its number; R in 0.001 mm for 3624",
    ),
    "grbl": Convention(
        "factor of steps per mm ($100 to $102); play in mm ($160 to $162, grblHAL)",
        f"{_STEPS}; grblHAL adds the play to the motor in positive travel against negative travel",
        "$160 only for grblHAL with backlash compensation compiled in; homed after the change",
        "gnea/grbl, doc/markdown/settings.md; grblHAL, settings.h and motion_control.c",
    ),
    "marlin": Convention(
        "factor of M92; play in mm (M425)",
        f"{_STEPS}; M425 F1 adds the whole play to the motor in positive travel (after the start the last move counts"
        " as negative)",
        "BACKLASH_COMPENSATION and BACKLASH_GCODE compiled in; M500 keeps it; homed after the change",
        "MarlinFirmware/Marlin, src/feature/backlash.cpp, src/gcode/config/M92.cpp",
    ),
    "rrf": Convention(
        "factor (M579); play in mm (M425)",
        "every command is multiplied by M579 from machine zero; M425 adds the play to the motor in positive travel"
        " against negative travel",
        "M579 and M425 in config.g; M425 with RepRapFirmware 3.5 or newer; homed after the change",
        "Duet3D/RepRapFirmware, src/GCodes/GCodes.cpp (axisScaleFactors); Duet3D, G-code dictionary, M425",
    ),
    "csv": Convention(
        "um, the error in positive and in negative travel",
        "whoever applies it takes the error off the reading or adds it to the command",
        "travel in a direction for longer than its play",
        "stepgauge, docs/compensation.md",
    ),
}
"""By ``--to``."""
_SKEW = "added to the first axis on the way to the motors"
SKEW_CONVENTIONS = {
    "marlin": Convention(
        "factor = minus the skew; M852 I for xy, J for xz, K for yz",
        f"minus factor times the second axis is {_SKEW}",
        "SKEW_CORRECTION and SKEW_CORRECTION_GCODE compiled in, for xz and yz SKEW_CORRECTION_FOR_Z; M500 keeps it",
        "MarlinFirmware/Marlin, src/module/planner.h (skew)",
    ),
    "klipper": Convention(
        "mm, diagonals AC and BD and side AD of a square as the machine makes it, of factor minus the skew",
        f"minus factor times the second axis is {_SKEW}",
        "section [skew_correction]; after every start SET_SKEW or SKEW_PROFILE LOAD",
        "Klipper3d/klipper, klippy/extras/skew_correction.py (calc_skew_factor, calc_skew)",
    ),
    "rrf": Convention(
        "S mm of the second axis, X (xy), Y (yz), Z (xz) mm of the first: the skew times S",
        f"value / S times the second axis is {_SKEW}",
        "M556 in config.g; P0, so that x is corrected and not y",
        "Duet3D/RepRapFirmware, src/Movement/Move.cpp, Move3.cpp (AxisTransform)",
    ),
}
"""Firmwares that correct a skew, by ``--to``; skew: the indicated first axis is too large by it times the second."""
