"""Recordings of the shipped gauge as consoles, logs and tables of points; 16 points; certificates."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pandas as pd

from stepgauge.gauge.certified import read_gauge
from tests.dcc.made import gauge_xml
from tests.importing.layouts.judge import AXIS, CERTIFICATE, GAUGE, POINTS, Layout
from tests.importing.layouts.truth import BESIDE, ON_GAUGE, comma, lines, probed

GRBL = "gnea/grbl, doc/markdown/interface.md: [PRB:..] in machine coordinates, $13, $#, ALARM"
SENDERS = "public senders (UGS, Candle, cncjs) and FluidNC"
HANDED = "tables as laboratories hand them over (findings of the project)"
LINUXCNC = "LinuxCNC manual, (LOG,..) and (PROBEOPEN ..)"
PRINTED = "programs of stepgauge on Fanuc (DPRNT), SINUMERIK (WRITE), HEIDENHAIN (FN16), RepRapFirmware (echo)"
POSTS = "results files of inspection posts (G800, G801)"
DMIS = "DMIS 5.2, output format"
IPP = "I++ DME 1.7, 6.3.2.13"
DCC = "DCC schema 3.2, realListXMLList; names of quantities as laboratories write them"
FINE, THOUSANDTHS = probed(), probed(digits=3)
RADIUS = {"--tip-radius": "2"}
SHARED = {"beside": BESIDE, "options": ON_GAUGE, "knows": RADIUS}


def told(frame: pd.DataFrame) -> pd.DataFrame:
    """What is compared of a recording."""
    return frame[["cycle", "face", "x_mm", "y_mm", "z_mm"]]


def report(x: float, y: float = 300.0, z: float = 200.0, hit: int = 1, more: str = "") -> str:
    """A report of the probe."""
    return f"[PRB:{x:.3f},{y:.3f},{z:.3f}{more}:{hit}]"


def console(row: Callable[[pd.Series], str], before: str = "", after: str = "") -> str:
    return f"Grbl 1.1h ['$' for help]\n{before}" + lines(THOUSANDTHS, row) + after


def fast_then_slow(r: pd.Series) -> str:
    """A coarse touch that goes 8 um too far, and the fine one that counts."""
    sign = 1.0 if r.face % 2 else -1.0
    return f"{report(r.x_mm + 0.021 * sign)}\nok\n{report(r.x_mm)}\nok"


def best_of_three(r: pd.Series) -> str:
    """A coarse touch and two fine ones that agree to the last digit."""
    sign = 1.0 if r.face % 2 else -1.0
    return f"{report(r.x_mm + 0.021 * sign)}\nok\n{report(r.x_mm)}\nok\n{report(r.x_mm)}\nok"


def inch(value: float) -> str:
    return f"{value / 25.4:.5f}"


INCHES = FINE.assign(x_mm=[round(round(x / 25.4, 5) * 25.4, 9) for x in FINE.x_mm], y_mm=300.0, z_mm=200.0)
INCHES = INCHES.assign(y_mm=round(300.0 / 25.4, 5) * 25.4, z_mm=round(200.0 / 25.4, 5) * 25.4)
PRB_INCH = lines(FINE, lambda r: f"[PRB:{inch(r.x_mm)},{inch(300.0)},{inch(200.0)}:1]\nok")


def numbered(row: Callable[[int, pd.Series], str]) -> str:
    return "".join(row(n, one) + "\n" for n, (_, one) in enumerate(FINE.iterrows(), 1))


def normal(r: pd.Series) -> int:
    """Outward normal of a face along x."""
    return -1 if r.face % 2 else 1


def session() -> str:
    text = "00001 StartSession()\n00001 &\n00001 %\n"
    text += numbered(
        lambda n, r: (
            f"{n + 9:05d} PtMeas(X({r.x_mm}), Y(300), Z(200), IJK({normal(r)}, 0, 0))\n{n + 9:05d} &\n"
            f"{n + 9:05d} # X({r.x_mm}), Y(300.0), Z(200.0)\n{n + 9:05d} %"
        )
    )
    return text + "90000 EndSession()\n90000 &\n90000 %\n"


def dmis(sensor: str = "S(P)=SNSDEF/PROBE,FIXED,CART,0,0,0,0,0,-1,4.0") -> str:
    return (
        f"DMISMN/'RUN',05.2\nUNITS/MM,ANGDEC\n{sensor}\nPRCOMP/OFF\n"
        + numbered(
            lambda n, r: f"FA(C{int(r.cycle)}F{int(r.face)})=FEAT/POINT,CART,{r.x_mm},300.0,200.0,{normal(r)},0,0"
        )
        + "ENDFIL\n"
    )


def sixteen() -> pd.DataFrame:
    """Tip centres of a ball of 2 mm on the first and the last block, as the help of locate numbers them."""
    gauge = read_gauge("step-gauge-420")
    rows = []
    for block in (1, gauge.n_blocks):
        front, back = gauge.position_mm[2 * block - 2 : 2 * block] + 115.0
        middle = (front + back) / 2.0
        rows += [(front - 2, 306, 196.25), (front - 2, 294, 196.25), (front - 2, 300, 204.5), (middle, 288, 200)]
        rows += [(middle, 312, 200), (middle, 300, 209.5), (middle, 286, 194.5), (back + 2, 300, 200)]
    return pd.DataFrame(rows, columns=["x", "y", "z"]).round(4)


SIXTEEN = sixteen()
CENTRE = pd.DataFrame([(SIXTEEN.x[[0, 7]].mean(), 300.0, 200.0)], columns=["x", "y", "z"]).round(3)
XML = gauge_xml()
POSITION = read_gauge("step-gauge-420").position_mm
FACES = pd.DataFrame({"face": np.arange(1, len(POSITION) + 1), "position": POSITION.round(6)})


def certificate(name: str, sign: float, unit: str = r"\micro\metre", factor: float = 1e3) -> str:
    """The shipped certificate with deviations in place of positions."""
    nominal = np.array(re.findall(r"<si:valueXMLList>([^<]*)", XML)[1].split(), float)
    values = " ".join(f"{sign * one * factor:.6f}" for one in POSITION - nominal)
    at = XML.index('<dcc:quantity refType="basic_measuredValue">')
    head, tail = XML[:at], XML[at:]
    tail = tail.replace('<dcc:quantity refType="basic_measuredValue">', "<dcc:quantity>", 1)
    tail = tail.replace("Position of the face from face 1", name, 1)
    tail = re.sub(r"<si:valueXMLList>[^<]*", lambda _: f"<si:valueXMLList>{values}", tail, count=1)
    tail = re.sub(r"<si:unitXMLList>[^<]*", lambda _: f"<si:unitXMLList>{unit}", tail, count=1)
    uncertainty = re.search(r"<si:uncertaintyXMLList>([^<]*)", tail)
    assert uncertainty
    scaled = " ".join(f"{float(one) * factor:.6f}" for one in uncertainty[1].split())
    return head + tail.replace(uncertainty[1], scaled, 1)


def dcc(name: str, title: str, sign: float, truth: pd.DataFrame | None = FACES, **knows: str) -> Layout:
    answers = {f"--{key}": value for key, value in knows.items()}
    return Layout(name, DCC, CERTIFICATE, certificate(title, sign), truth, ".xml", knows=answers)


LAYOUTS = [
    Layout(
        "grbl console", GRBL, GAUGE, console(lambda r: f"{report(r.x_mm)}\nok"), told(THOUSANDTHS), ".log", **SHARED
    ),
    Layout(
        "grbl console with travel that watched the probe, and $# at its end",
        GRBL,
        GAUGE,
        console(
            lambda r: f"{report(r.x_mm - 5, hit=0)}\nok\n{report(r.x_mm)}\nok",
            after="[G54:0.000,0.000,0.000]\n[G92:0.000,0.000,0.000]\n[TLO:0.000]\n"
            + report(THOUSANDTHS.x_mm.iloc[-1])
            + "\nok\n",
        ),
        told(THOUSANDTHS),
        ".log",
        **SHARED,
    ),
    Layout(
        "FluidNC, four axes and messages",
        SENDERS,
        GAUGE,
        console(lambda r: f"[MSG:INFO: probing]\n{report(r.x_mm, more=',0.000')}\nok"),
        told(THOUSANDTHS),
        ".log",
        **SHARED,
    ),
    Layout(
        "console of a sender that repeats the commands and stamps the lines",
        SENDERS,
        GAUGE,
        console(
            lambda r: (
                f"10:11:12.123 >>> G38.2 X{r.x_mm + 2:.3f} F100\n10:11:13.456 <<< {report(r.x_mm)}\n10:11:13.457 <<< ok"
            )
        ),
        told(THOUSANDTHS),
        ".log",
        **SHARED,
    ),
    Layout(
        "console in a table of a sender, answer behind the command",
        SENDERS,
        GAUGE,
        console(lambda r: f"G38.2 X{r.x_mm + 2:.3f} F100 < {report(r.x_mm)};ok"),
        told(THOUSANDTHS),
        ".log",
        **SHARED,
    ),
    Layout("grbl, fast then slow touch", GRBL, GAUGE, console(fast_then_slow), told(THOUSANDTHS), ".log", **SHARED),
    Layout(
        "grbl, a coarse and two fine touches", GRBL, GAUGE, console(best_of_three), told(THOUSANDTHS), ".log", **SHARED
    ),
    Layout(
        "grbl in inches, $13=1 in the console",
        GRBL,
        GAUGE,
        "Grbl 1.1h ['$' for help]\n$10=1\n$13=1\n" + PRB_INCH,
        told(INCHES),
        ".log",
        **SHARED,
    ),
    Layout(
        "grbl in inches, stated nowhere",
        GRBL,
        GAUGE,
        PRB_INCH,
        told(INCHES),
        ".log",
        beside=BESIDE,
        options=ON_GAUGE,
        knows={**RADIUS, "--unit": "inch"},
    ),
    Layout(
        "grbl, an alarm in the middle and the run taken up again",
        GRBL,
        GAUGE,
        console(
            lambda r: (
                f"{report(r.x_mm)}\nok"
                + ("\nALARM:1\n[MSG:Reset to continue]\n\nok" if r.cycle == 1 and r.face == 5 else "")
            )
        ),
        told(THOUSANDTHS),
        ".log",
        beside=BESIDE,
        options=ON_GAUGE,
        knows={**RADIUS, "--accept": "alarm"},
        must_ask=True,
    ),
    Layout(
        "LinuxCNC (LOG,..)",
        LINUXCNC,
        GAUGE,
        numbered(lambda n, r: f"{n} {r.x_mm:.7f} 300.0000000 200.0000000 1"),
        told(FINE),
        ".txt",
        **SHARED,
    ),
    Layout(
        "LinuxCNC (PROBEOPEN ..)",
        LINUXCNC,
        GAUGE,
        numbered(lambda n, r: f"{r.x_mm:.6f} 300.000000 200.000000 " + " ".join(["0.000000"] * 6)),
        told(FINE),
        ".txt",
        **SHARED,
    ),
    Layout(
        "LinuxCNC (PROBEOPEN ..), table turned by 90 deg",
        LINUXCNC,
        GAUGE,
        numbered(lambda n, r: f"{r.x_mm:.6f} 300.000000 200.000000 90.000000 " + " ".join(["0.000000"] * 5)),
        None,
        ".txt",
        **SHARED,
    ),
    Layout(
        "printed by a control",
        PRINTED,
        GAUGE,
        "%\n STEPGAUGE 16 POINTS\n"
        + numbered(lambda n, r: f" N {n} X {r.x_mm:.4f} Y 300.0000 Z 200.0000")
        + " END\n%\n",
        told(FINE),
        ".txt",
        **SHARED,
    ),
    Layout(
        "results of an inspection post",
        POSTS,
        GAUGE,
        "START\n"
        + numbered(
            lambda n, r: (
                f"G800 N{n} X{r.x_mm:.3f} Y300. Z200. I{normal(r)}. J0. K0. O0. U.1 L-.1\n"
                f"G801 N{n} X{r.x_mm:.4f} Y300. Z200. R2."
            )
        )
        + "END\n",
        told(FINE),
        ".txt",
        **SHARED,
    ),
    Layout("DMIS output", DMIS, GAUGE, dmis(), told(FINE), ".dmo", beside=BESIDE, options=ON_GAUGE),
    Layout(
        "DMIS output, a word behind the diameter of the tip",
        DMIS,
        GAUGE,
        dmis("S(P)=SNSDEF/PROBE,FIXED,CART,0,0,0,0,0,-1,4.0,SPHERE"),
        told(FINE),
        ".dmo",
        beside=BESIDE,
        options=ON_GAUGE,
    ),
    Layout("I++ session", IPP, GAUGE, session(), told(FINE), ".log", **SHARED),
    Layout(
        "points in columns of spaces",
        HANDED,
        GAUGE,
        "X [mm]   Y [mm]   Z [mm]\n" + lines(FINE, lambda r: f"{r.x_mm:.4f}   300.0000   200.0000"),
        told(FINE),
        ".txt",
        **SHARED,
    ),
    Layout(
        "points without a header",
        HANDED,
        GAUGE,
        lines(FINE, lambda r: f"{r.x_mm:.4f},300.0000,200.0000"),
        told(FINE),
        ".csv",
        beside=BESIDE,
        options=ON_GAUGE,
        knows={**RADIUS, "--header": "x_mm,y_mm,z_mm"},
    ),
    Layout(
        "points of a CMM, decimal commas, names of points",
        HANDED,
        GAUGE,
        "Messprotokoll\nPunkt;X-Ist [mm];Y-Ist [mm];Z-Ist [mm]\n"
        + numbered(lambda n, r: f"PNT{n};{comma(r.x_mm)};{comma(300)};{comma(200)}"),
        told(FINE),
        **SHARED,
    ),
    Layout(
        "recording with an empty column of temperatures and empty rows",
        HANDED,
        GAUGE,
        "cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k,gauge_temperature_C\n"
        + lines(FINE, lambda r: f"{int(r.cycle)},{int(r.face)},{r.x_mm:.4f},300.0,200.0,{-normal(r)},0,0,")
        + ",,,,,,,,\n,,,,,,,,\n",
        told(FINE),
        beside=BESIDE,
        options=ON_GAUGE[:2],
        knows=RADIUS,
    ),
    Layout(
        "recording in Windows-1252",
        HANDED,
        GAUGE,
        (
            "# Messgerät: Brücke, Temperatur °C\ncycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k\n"
            + lines(FINE, lambda r: f"{int(r.cycle)},{int(r.face)},{r.x_mm:.4f},300.0,200.0,{-normal(r)},0,0")
        ).encode("cp1252"),
        told(FINE),
        beside=BESIDE,
        options=ON_GAUGE[:2],
        knows=RADIUS,
    ),
    Layout(
        "two placements below one another, told apart by nothing",
        HANDED,
        GAUGE,
        "cycle,face,x_mm,y_mm,z_mm,approach_i,approach_j,approach_k\n"
        + lines(FINE, lambda r: f"{int(r.cycle)},{int(r.face)},{r.x_mm:.4f},300.0,200.0,{-normal(r)},0,0")
        + lines(FINE, lambda r: f"{int(r.cycle)},{int(r.face)},100.0,{r.x_mm + 85:.4f},300.0,0,{-normal(r)},0"),
        None,
        beside=BESIDE,
        options=ON_GAUGE[:2],
    ),
    Layout(
        "face, nominal and measured position of a gauge",
        HANDED,
        AXIS,
        "Face,Nominal,Measured\n"
        + "".join(f"{n},{n * 10 - 10},{n * 10 - 10 + n * n * 1e-4:.4f}\n" for n in range(1, 9)),
        pd.DataFrame({"target": [n * 10.0 - 10 for n in range(1, 9)], "deviation": [n * n * 0.1 for n in range(1, 9)]}),
        sensor="touch",
        knows={"--unit": "mm"},
    ),
    Layout(
        "16 points of a display, decimal commas",
        HANDED,
        POINTS,
        "Punkt;X [mm];Y [mm];Z [mm]\n"
        + "".join(f"{n};{comma(x)};{comma(y)};{comma(z)}\n" for n, (x, y, z) in enumerate(SIXTEEN.to_numpy(), 1)),
        CENTRE,
        options=ON_GAUGE[:2],
    ),
    Layout(
        "16 points from the last to the first, in inches",
        HANDED,
        POINTS,
        "No.,X (inch),Y (inch),Z (inch)\n"
        + "".join(
            f"{n},{x / 25.4:.6f},{y / 25.4:.6f},{z / 25.4:.6f}\n"
            for n, (x, y, z) in reversed(list(enumerate(SIXTEEN.to_numpy(), 1)))
        ),
        CENTRE,
        options=ON_GAUGE[:2],
    ),
    Layout(
        "16 points in the console of grbl",
        GRBL,
        POINTS,
        "".join(f"[PRB:{x:.3f},{y:.3f},{z:.3f}:1]\nok\n" for x, y, z in SIXTEEN.round(3).to_numpy()),
        CENTRE,
        ".log",
        options=ON_GAUGE[:2],
    ),
    Layout("certificate with positions", DCC, CERTIFICATE, XML, FACES, ".xml"),
    dcc("certificate with deviations, measured minus nominal", "Deviation (measured minus nominal)", 1.0),
    dcc("certificate with deviations, nominal minus measured", "Deviation (nominal minus measured)", -1.0),
    dcc("certificate with deviations, Nennmass minus Istmass", "Abweichung Nennmass minus Istmass", -1.0),
    dcc("certificate with deviations, Soll-Ist", "Abweichung Soll-Ist", -1.0),
    dcc("certificate with deviations whose sign nothing states", "Deviation", 1.0),
]
