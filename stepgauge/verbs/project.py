"""The verbs of a project at the screen: init, status, web."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from stepgauge.verbs.define import verb
from stepgauge.verbs.kind import ARGUMENT
from stepgauge.verbs.kinds import Count, Flag, Reads, Supplied, Text
from stepgauge.verbs.shared import DIALECT, File

if TYPE_CHECKING:
    from stepgauge.project.create import CreatedProject
    from stepgauge.project.status import Status

QUESTIONS = (
    ("gauge", "Gauge file, or the name of a shipped one", "step-gauge-420"),
    ("machine", "Machine file, or the name of a shipped one", "bridge-cmm"),
    ("operator", "Who measures (may stay empty)", ""),
    ("location", "Where (may stay empty)", ""),
)
Words = Annotated[str | None, Text()]


@verb(in_project=False)
def init(
    folder: Annotated[File, Text("[FOLDER]"), ARGUMENT] = ".",
    *,
    gauge: Annotated[File | None, Reads("GAUGE", room=".", short="g")] = None,
    machine: Annotated[File | None, Reads("MACHINE", room="machines", short="m")] = None,
    dialect: Annotated[str | None, DIALECT] = None,
    operator: Words = None,
    customer: Words = None,
    location: Words = None,
    certificate: Annotated[File | None, Reads("FILE")] = None,
    ask: Annotated["Callable[[str, str], str] | None", Supplied("prompt")] = None,
    tell: Annotated["Callable[[str], None]", Supplied("tell")] = print,
) -> "CreatedProject":
    """Make a project: one file that states once what every verb would have to be given.

    What is not given as an option is asked for. In the folder and below it, verbs take from stepgauge.toml what is left
    out on the command line, and say so; 'stepgauge status' shows what is there and what to do next.

    Parameters
    ----------
    folder : folder of the project
    gauge : gauge file, or the name of a shipped one, which is copied
    machine : machine file, or the name of a shipped one, which is copied
    dialect : language of the measuring programs
    operator : who measures, for the reports
    customer : for whom, for the reports
    location : where, for the reports
    certificate : file with what a certificate of the laboratory states
    ask : asks a person a question with a usual answer; default: nobody is there
    tell : called with what is wrong with an answer, before it is asked again

    Examples
    --------
    stepgauge init my-machine --gauge step-gauge-420 --machine bridge-cmm --dialect dmis
    cd my-machine
    stepgauge status
    """
    from stepgauge.errors import InputError, naming
    from stepgauge.project.create import NewProject, create_project

    stated: dict[str, Any] = {"gauge": gauge, "machine": machine, "operator": operator, "location": location}
    for key, question, usual in QUESTIONS if ask else ():
        if stated[key] is None and ask is not None:
            stated[key] = _answer(key, question, usual, ask, tell)
    for key in ("gauge", "machine"):
        if not stated[key]:
            raise InputError(naming(key), "is missing, and nobody is there to be asked", expected="a file or a name")
    texts = {"operator": stated["operator"], "customer": customer, "location": stated["location"]}
    texts = {key: value for key, value in {**texts, "certificate": certificate}.items() if value}
    return create_project(folder or ".", NewProject(str(stated["gauge"]), str(stated["machine"]), texts, dialect))


def _answer(key: str, question: str, usual: str, ask: Callable[[str, str], str], tell: Callable[[str], None]) -> str:
    """An answer that can be used; one that names no such file is asked again."""
    from stepgauge.errors import InputError
    from stepgauge.gauge.certified import read_gauge
    from stepgauge.machine.file import read_machine

    read: dict[str, Callable[[str], Any]] = {"gauge": read_gauge, "machine": read_machine}
    while True:
        answer = ask(question, usual)
        try:
            if key in read and answer:
                read[key](answer)
            return answer
        except InputError as error:
            tell(error.cli_text())


@verb(shows=True, in_project=False)
def status() -> "Status":
    """What the project has, and what to do next.

    Everything that the project file names and that lies in its folders, what is wrong with it or older than what it was
    made from, and the next command.
    """
    from stepgauge.errors import InputError
    from stepgauge.project.file import read_project
    from stepgauge.project.find import NAME, find_project
    from stepgauge.project.status import project_status
    from stepgauge.verbs.catalogue import VERBS

    path = find_project()
    if path is None:
        raise InputError(NAME, "not found here or in a folder above", expected="a project: 'stepgauge init' makes one")
    return project_status(read_project(path, VERBS))


@verb(in_project=False)
def web(
    project: Annotated[File | None, Text("[PROJECT]"), ARGUMENT] = None,
    *,
    host: Annotated[str | None, Text("HOST")] = None,
    port: Annotated[int | None, Count(0, 65535)] = None,
    no_browser: Annotated[bool, Flag()] = False,
    tell: Annotated["Callable[[str], None]", Supplied("tell")] = print,
    ready: Annotated["Callable[[str], None]", Supplied("print")] = print,
) -> None:
    """Show a project in a browser: locate, plan, measure, evaluate, diagnose, report.

    PROJECT is its folder; by default the nearest one from the working folder upward, else the working folder, in which
    the page then makes one. Everything the page shows is a file that the other verbs wrote or could write; it needs no
    network, and ends on Ctrl-C. Needs the extra: pip install 'stepgauge[web]'.

    The address carries a token: whoever has it can change the project and move the machine, and nobody else, other
    users of this computer neither. With ``host`` other computers can reach it. There is no encryption: use it in a
    network that you trust.

    Parameters
    ----------
    project : folder of the project
    host : listen here; default: for this computer alone (127.0.0.1)
    port : TCP port; default: 8420; where taken, a free one
    no_browser : print the address, and do not open a browser
    tell : called with a warning
    ready : called with the address once requests are answered

    Examples
    --------
    stepgauge web
    stepgauge web my-machine --port 8500 --no-browser
    """
    from stepgauge.errors import InputError
    from stepgauge.verbs.catalogue import VERBS

    try:
        from stepgauge.web.server import serve_project
    except ImportError as missing:
        what = f"the page needs the extra 'web' ({missing.name} is missing)"
        raise InputError("web", what, expected="pip install 'stepgauge[web]'") from None
    serve_project(project, VERBS, host, port, not no_browser, tell, ready)
