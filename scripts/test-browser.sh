#!/usr/bin/env bash
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Holds the report's page against a real browser: scripts/test-browser.sh [SHEAF]. Ends with 77 where
# there is no Chromium (Debian's package: chromium). With axe-core (`npm ci` in tests/browser/) its
# rules of accessibility are tried too.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
axe=tests/browser/node_modules/axe-core/axe.min.js
[ -f "$axe" ] || axe=
exec python3 tests/browser/report_test.py "${1:-build/ci/sheaf}" $axe
