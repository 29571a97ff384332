"""axe-core (npm, for tests alone): what it finds wrong with a page for people who cannot see or point."""
import io
import os
import shutil
import subprocess
import tarfile
import tempfile

VERSION = "4.10.3"
SHOWN = """
const done = arguments[arguments.length - 1];
axe.run(document, {resultTypes: ["violations"]}).then(
  told => done(told.violations.map(one => `${one.id}: ${one.help}: ${one.nodes.map(node => node.html).join(" | ")}`)),
  problem => done([String(problem)]));
"""


def source(folder):
    """Its text, and why there is none. Fetched once, into the folder."""
    path = os.path.join(folder, f"axe-{VERSION}.js")
    if not os.path.exists(path):
        if not shutil.which("npm"):
            return None, "there is no npm to fetch axe-core with"
        with tempfile.TemporaryDirectory() as scratch:
            try:
                fetched = subprocess.run(["npm", "pack", "--silent", f"axe-core@{VERSION}"], cwd=scratch, timeout=60,
                                         stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, universal_newlines=True)
            except subprocess.TimeoutExpired:
                return None, "npm does not reach axe-core within a minute"
            if fetched.returncode != 0:
                return None, "npm does not reach axe-core"
            with tarfile.open(os.path.join(scratch, fetched.stdout.split()[-1])) as package:
                text = package.extractfile("package/axe.min.js").read()
        os.makedirs(folder, exist_ok=True)
        with open(path + ".new", "wb") as file:
            file.write(text)
        os.replace(path + ".new", path)
    with io.open(path, encoding="utf-8") as file:
        return file.read(), ""


def violations(browser, text):
    """Of what the browser shows. The page's own policy forbids foreign scripts; WebDriver's are not bound by it."""
    browser.run(text + "; window.axe = axe;")
    return browser.run_async(SHOWN)
