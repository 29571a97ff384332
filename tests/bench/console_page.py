#!/usr/bin/python3
"""How soon the console's page is there, and how soon its list follows what is typed, in headless Chromium.

Makes a store of many behaviors in a temporary folder, unless --store says one, serves it with `afterglow console`,
opens the page again and again and types words a letter at a time. Exits with 1 if a limit is exceeded: the list is
shown 1 s after the address was opened (median), a letter's matches 100 ms after it (median).

  tests/bench/console_page.py                                 1,000 behaviors of 120 messages
  tests/bench/console_page.py --messages 1000                 with a million messages
"""
import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
sys.path[:0] = [os.path.join(ROOT, "tests", "console"), os.path.join(ROOT, "build/devel/lib/python3/dist-packages")]

from browser import MISSING, Driver, until  # noqa: E402

LIMIT_LIST_MS, LIMIT_LETTER_MS = 1000, 100
WORDS = ("gearbox", "I dropped the screw", "drive 7", "nothing of the kind")
# Before any script of the page: when the first row with a name is drawn.
WATCH = """
new MutationObserver((_, watch) => {
  if (!document.querySelector('.row .name')) return;
  watch.disconnect();
  requestAnimationFrame(() => setTimeout(() => { window.listShown = performance.now(); }));
}).observe(document, {childList: true, subtree: true});
"""
# Types a letter; calls back with the ms until the answer to it stood in the list, and was drawn.
TYPE = """
const [text, done] = arguments, input = document.querySelector('#search'), begin = performance.now();
const said = document.querySelector('#matching');
const watch = new MutationObserver(() => {
  watch.disconnect();
  requestAnimationFrame(() => setTimeout(() => done(performance.now() - begin)));
});
watch.observe(said, {childList: true, characterData: true, subtree: true});
input.value = text;
input.dispatchEvent(new Event('input'));
"""


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--command", default=os.path.join(ROOT, "build", "bin", "afterglow"))
    parser.add_argument("--store", help="a store that is there already")
    parser.add_argument("--behaviors", type=int, default=1000)
    parser.add_argument("--messages", type=int, default=120, help="of each behavior")
    parser.add_argument("--times", type=int, default=10, help="the page is opened so often")
    return parser.parse_args()


def make_store(arguments, folder):
    import recordings
    names = ("pick", "place", "drive")
    words = ("I pick the gearbox bottom.", "I have it.", "I dropped the screw.", "There is something in my way.")
    paths = []
    for at in range(arguments.behaviors):
        paths.append(os.path.join(folder, f"{names[at % 3]}_{at}.bag"))
        length = arguments.messages / 12  # 10 velocities and 2 markers a second
        recordings.write_bag(paths[-1], recordings.BEGIN_S + at * 900, length, [words[at % 4], words[(at // 4) % 4]])
    store = os.path.join(folder, "store.db")
    recordings.import_bags(arguments.command, store, paths)
    for path in paths:
        os.remove(path)
    return store


def measure(browser, url, times):
    """[ms] of the first paint, of the list, of each letter."""
    browser.devtools("Page.enable")
    browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
    paints, lists, letters = [], [], []
    for _ in range(times):
        browser.open("about:blank")
        browser.devtools("Network.clearBrowserCache")
        browser.open(url)
        lists.append(until(lambda: browser.run("return window.listShown"), "the list"))
        paints.append(browser.run("return performance.getEntriesByName('first-contentful-paint')[0].startTime"))
    for word in WORDS:
        for end in range(1, len(word) + 1):
            letters.append(browser.run_async(TYPE, word[:end]))
    return paints, lists, letters


def tell(name, values, limit):
    median = statistics.median(values)
    print(f"{name:32} median {median:6.0f} ms   worst {max(values):6.0f} ms   of {len(values)}")
    return median <= limit


def main():
    arguments = parse_arguments()
    if MISSING:
        sys.exit("console_page.py: " + MISSING)
    with tempfile.TemporaryDirectory(prefix="console_page.") as folder:
        store = arguments.store or make_store(arguments, folder)
        console = subprocess.Popen([arguments.command, "console", "--store", store, "--port", "0"],
                                   stdout=subprocess.PIPE, universal_newlines=True)
        driver = Driver()
        try:
            url = re.search(r"http://[^ ;]+/", console.stdout.readline())[0]
            browser = driver.browser()
            paints, lists, letters = measure(browser, url, arguments.times)
            browser.close()
        finally:
            driver.close()
            console.terminate()
            console.wait()
    kept = [tell("first paint, nothing cached", paints, LIMIT_LIST_MS), tell("the list", lists, LIMIT_LIST_MS),
            tell("a letter's matches", letters, LIMIT_LETTER_MS)]
    sys.exit(0 if all(kept) else 1)


if __name__ == "__main__":
    main()
