#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Builds every page of the project (*.md) as a site with search in build/site, with the versions of
# docs/requirements.txt in a virtual environment, and in build/site/api what Doxygen makes of the
# public headers. A link between pages, or to a heading, that leads nowhere is an error; so is one to
# a file that the project does not have, and a warning of Doxygen.
#   scripts/build-docs.sh
# scripts/install-deps.sh --docs installs Doxygen; without it there is no build/site/api.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
env=build/docs-env pages=build/docs-pages
[ -x "$env/bin/python" ] || python3 -m venv "$env"
"$env/bin/python" -m pip install --quiet --disable-pip-version-check -r docs/requirements.txt

# The pages as they lie in the project, so that their links hold; other files that they link to come
# along as they are.
rm -rf "$pages"
mkdir -p "$pages"
"$env/bin/python" - "$pages" <<'PROGRAM'
import pathlib, re, shutil, subprocess, sys

pages = pathlib.Path(sys.argv[1])
tracked = set(subprocess.check_output(["git", "ls-files"], text=True).splitlines())
root = pathlib.Path(".").resolve()
sources = sorted(p for p in tracked if p.endswith(".md"))
wrong = 0
for name in sources:
    target = pages / name
    target.parent.mkdir(parents=True, exist_ok=True)
    text = pathlib.Path(name).read_text(encoding="utf-8")
    for number, line in enumerate(text.splitlines(), 1):
        for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", line):
            if re.match(r"[a-z]+:", link):
                continue
            there = (pathlib.Path(name).parent / link).resolve()
            if not there.exists() or not there.is_relative_to(root):
                print(f"docs: {name}: line {number}: found a link to {link}, expected a file of the project")
                wrong += 1
            elif there.is_file() and not link.endswith(".md"):
                copy = pages / there.relative_to(root)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(there, copy)
            elif there.is_dir():  # a site shows no folders: the words stay
                text = re.sub(r"\[([^\]]*)\]\(" + re.escape(link) + r"\)", r"\1", text)
    target.write_text(text, encoding="utf-8")
for image in tracked:
    if image.startswith("docs/") and image.rsplit(".", 1)[-1] in ("png", "svg", "jpg", "gif"):
        (pages / image).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(image, pages / image)
sys.exit(1 if wrong else 0)
PROGRAM
# Not --quiet: that would drop the warnings before --strict counts them.
"$env/bin/mkdocs" build --strict --clean 2>build/docs.log ||
  { grep -v '^INFO' build/docs.log >&2; exit 1; }

if command -v doxygen >/dev/null; then
  doxygen - <<'SETTINGS'
PROJECT_NAME = Sheaf
PROJECT_BRIEF = "Bundle adjustment engine: public headers"
INPUT = include/sheaf
STRIP_FROM_INC_PATH = include
OUTPUT_DIRECTORY = build/site
HTML_OUTPUT = api
GENERATE_LATEX = NO
HAVE_DOT = NO
JAVADOC_AUTOBRIEF = YES
EXTRACT_ALL = NO
WARN_IF_UNDOCUMENTED = NO
WARN_AS_ERROR = FAIL_ON_WARNINGS
QUIET = YES
SETTINGS
else
  echo "docs: Doxygen is not here: NO PAGES of the public headers"
fi
echo "docs: $(find build/site -name '*.html' | wc -l) pages in build/site"
