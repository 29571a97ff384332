/// \file
/// The command `afterglow` and its verbs. It is several programs, since loading what some verbs
/// need (ROS, OpenCV, the renderer) takes ten times as long as others take to list a store. The one
/// that is called loads none of the libraries: libmongoc's counters in shared memory, which bear a
/// process's number, would be left behind.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace afterglow::nodes {

using AddVerb = void (*)(CLI::App&);

/// Parses the command line, does what its verb says and returns the exit status: 0 done; 1 refused
/// or failed, with one line on stderr; 2 wrong usage.
int runCommand(int argc, char** argv, const std::vector<AddVerb>& verbs);

/// The words behind "--" if the verb runs a command (kVerbs in command.cpp): that command's own
/// words, of which CLI11 sees none. Empty before runCommand(), and without any.
const std::vector<std::string>& wordsBehindDashes();

/// Says on stderr, in one line, that there is no such verb; the exit status.
int refuseVerb(const std::string& word);
/// Returns the program, which lies beside this one, that does a verb; null for an unknown verb.
const char* programOf(const std::string& verb);
/// Goes on as that program, with the same arguments. Returns (1, with one line on stderr) only if
/// it cannot be started.
int becomeProgram(const char* name, const std::string& verb, char** argv);

/// Registers all verbs by name and help alone, as --help lists them.
void addVerbNames(CLI::App& app);
/// Registers one of them; what it takes and does is added by the functions below.
CLI::App* addVerb(CLI::App& app, const std::string& name);

// Each registers its verb in the program that does it, from a file of its own; parsing it does the
// job. Failures are exceptions.
void addAskVerb(CLI::App& app);
void addCalibrateVerb(CLI::App& app);
void addDoctorVerb(CLI::App& app);
void addEditVerb(CLI::App& app);
void addExampleVerb(CLI::App& app);
void addExportVerb(CLI::App& app);
void addImportVerb(CLI::App& app);
void addInfoVerb(CLI::App& app);
void addInitVerb(CLI::App& app);
void addListVerb(CLI::App& app);
void addPlayVerb(CLI::App& app);
void addRecordVerb(CLI::App& app);
void addRenderVerb(CLI::App& app);
void addSaidVerb(CLI::App& app);
void addShowVerb(CLI::App& app);
void addStoreVerb(CLI::App& app);
void addSyncVerb(CLI::App& app);
void addWatchVerb(CLI::App& app);

// The verbs of `afterglow calibrate`, likewise.
void addCalibrateBoard(CLI::App& calibrate);
void addCalibrateColor(CLI::App& calibrate);
void addCalibrateTexture(CLI::App& calibrate);
void addCalibrateLatency(CLI::App& calibrate);
void addCalibrateMount(CLI::App& calibrate);
void addCalibratePattern(CLI::App& calibrate);
void addCalibrateSolve(CLI::App& calibrate);
void addCalibrateVerify(CLI::App& calibrate);

}  // namespace afterglow::nodes
