"""A page in headless Chromium: what it says when it is through, and how long that took."""

import json
import re
import shutil
import subprocess

import pytest


def looked_at(page, folder, script, width=1280, height=900):
    """The JSON that `script` gives once the page is ready; the console must be silent. Skips without Chromium."""
    if not shutil.which("chromium") or subprocess.run(["chromium", "--version"], capture_output=True).returncode:
        pytest.skip("no chromium here; make tools installs it")
    probe = (
        "(async () => { const root = document.documentElement;"
        "for (let k = 0; k < 600 && !root.dataset.ready; k++) await new Promise((go) => setTimeout(go, 20));"
        f"const probed = await (async () => {{ {script} }})();"
        "const e = document.createElement('pre'); e.id = 'probe'; e.textContent = JSON.stringify(probed);"
        "document.body.append(e); })();"
    )
    import base64
    import hashlib

    digest = base64.b64encode(hashlib.sha256(probe.encode()).digest()).decode()
    # The page's own policy stands; it is told of this one script.
    text = page.replace("script-src '", f"script-src 'sha256-{digest}' '", 1).replace(
        "</body>", f"<script>{probe}</script></body>"
    )
    path = folder / "probed.html"
    path.write_text(text, encoding="utf-8")
    run = subprocess.run(
        [
            "chromium",
            "--headless=new",
            "--no-sandbox",
            "--no-first-run",
            "--disable-gpu",
            "--hide-scrollbars",
            "--disable-dev-shm-usage",
            "--disable-extensions",
            f"--user-data-dir={folder / 'profile'}",
            "--enable-logging=stderr",
            "--virtual-time-budget=20000",
            f"--window-size={width},{height}",
            "--dump-dom",
            f"file://{path}",
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert "CONSOLE" not in run.stderr, run.stderr
    found = re.search(r'<pre id="probe">(.*?)</pre>', run.stdout, re.S)
    assert found, run.stderr[-2000:]
    import html

    return json.loads(html.unescape(found.group(1)))
