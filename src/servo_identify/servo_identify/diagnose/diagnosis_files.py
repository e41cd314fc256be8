"""The files of a diagnosis: report.json, augmented.yaml and report.html in one folder."""

from __future__ import annotations

from pathlib import Path

from servo_twin.description.whole_file import write_whole
from servo_twin.physics.servo import Servo

from .answer.patch import difference, patched
from .diagnosis import Diagnosis


def write_diagnosis(found: Diagnosis, text: str, servo: Servo, output: Path, refit: bool = False,
                    page: bool = True, command: str = '') -> None:
    """
    Write report.json, augmented.yaml and, with ``page``, report.html into a folder.

    ``text`` is the servo file as it was given and ``servo`` what it says. With ``refit`` the
    augmented file has the values moved within tolerance as well.
    """
    found.report.save(output / 'report.json')
    new = patched(text, servo, found.refit if refit else found.augmented)
    write_whole(output / 'augmented.yaml', new)
    if page:
        from .page.document import document_of
        from .page.page import write_page
        write_page(document_of(found, difference(text, new), command), output / 'report.html')
