"""Runs a file of unittest as a test of ours: its cases are counted one by one, as those of GoogleTest are."""
import os
import sys
import unittest
import xml.etree.ElementTree as ET


class _Result(unittest.TextTestResult):
    """Also <case status="run|skipped">, as summarize.py reads them."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.suite = ET.Element("testsuites")

    def startTest(self, test):
        super().startTest(test)
        group, name = test.id().split(".")[-2:]
        self.case = ET.SubElement(self.suite, "testcase", classname=group, name=name, status="run")

    def addFailure(self, test, error):
        super().addFailure(test, error)
        self._fail()

    def addError(self, test, error):
        super().addError(test, error)
        self._fail()

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self.case.set("result", "skipped")
        ET.SubElement(self.case, "skipped", message=reason)

    def _fail(self):
        if hasattr(self, "case"):
            ET.SubElement(self.case, "failure")


def main():
    """Exits. A report goes where GTEST_OUTPUT ("xml:FOLDER/") says, for tests/run."""
    tests = sys.modules["__main__"]
    if not hasattr(tests, "tearDownModule"):
        tests.tearDownModule = lambda: None  # Python 3.9 does no module cleanups without
    runner = unittest.TextTestRunner(resultclass=_Result, warnings="ignore")  # of rospy
    ran = unittest.main(argv=sys.argv[:1], testRunner=runner, exit=False)
    kind, _, folder = os.environ.get("GTEST_OUTPUT", "").partition(":")
    if kind == "xml":
        # A file that runs again with another distribution of ROS 2 has a report for each.
        name = os.path.basename(sys.argv[0]) + os.environ.get("AFTERGLOW_TEST_ROS2", "")
        ET.ElementTree(ran.result.suite).write(os.path.join(folder, name + ".xml"))
    sys.exit(not ran.result.wasSuccessful())
