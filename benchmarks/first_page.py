"""Draw the first page of the bundled machine's report, which README shows.

    .venv/bin/python benchmarks/first_page.py

It needs the extra ``report``, and poppler's pdftoppm.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import flipflow as ff
from flipflow.report.pdf import pdf

PICTURE = Path(__file__).parents[1] / "docs" / "_static" / "report.png"
DOTS_AN_INCH = 80


def main():
    with tempfile.TemporaryDirectory() as folder:
        sheet = Path(folder) / "report.pdf"
        sheet.write_bytes(pdf(ff.assess(ff.load_project("ffs0827")), "a4"))
        tool = shutil.which("pdftoppm") or "pdftoppm"
        words = ["-png", "-r", str(DOTS_AN_INCH), "-f", "1", "-l", "1", "-singlefile"]
        subprocess.run([tool, *words, sheet, PICTURE.with_suffix("")], check=True)
    print(PICTURE)


if __name__ == "__main__":
    main()
