#include "nodes/verbs/command.hpp"

#include <unistd.h>

#include <CLI/Config.hpp>  // this and Formatter.hpp: what CLI::App's destructor needs to be linked
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "nodes/verbs/terminal_text.hpp"
#include "replay/query/nearest.hpp"

namespace afterglow::nodes {
namespace {

struct Verb {
  const char* name;
  const char* help;
  const char* program;
  bool runs_command = false;  ///< which stands behind "--"
};

// As --help lists them.
constexpr Verb kVerbs[] = {
    {"import", "Import bags and MCAP files, one behavior each, or a database of mongodb_log",
     "afterglow_store"},
    {"record", "Record topics as a behavior, as rosbag record does", "afterglow_play", true},
    {"example", "Let the simulated Fetch do something that is recorded", "afterglow_play"},
    {"list", "List behaviors, newest first", "afterglow_store"},
    {"show", "Show a behavior, its topics, its messages", "afterglow_store"},
    {"info", "Show what a bag, an MCAP file or a behavior holds, as rosbag info does",
     "afterglow_store"},
    {"said", "What the robot said and which sounds it played, newest first", "afterglow_store"},
    {"ask", "Ask the robot what it did, in words: which behavior answers, and what was said then",
     "afterglow_play"},
    {"play", "Replay a behavior into the running robot", "afterglow_play"},
    {"edit", "Rename, tag, note, trim or delete a behavior", "afterglow_store"},
    {"export", "Export behaviors as a bag or an MCAP file", "afterglow_store"},
    {"render", "Draw what a projector showed during a behavior, without a ROS master",
     "afterglow_render"},
    {"console", "Browse a store with a web browser: find behaviors, look at them moment by moment",
     "afterglow_console"},
    {"store", "Look after a store in a SQLite file", "afterglow_store"},
    {"sync", "Copy behaviors from one store to another; repeat it to go on where it broke off",
     "afterglow_store"},
    {"watch", "Show how projector, recorder and player fare, and why the floor is dark",
     "afterglow_play"},
    {"calibrate", "Calibrate a projector with printed and projected tags", "afterglow_calibrate"},
    {"doctor", "Check what this machine and the running robot have, with advice",
     "afterglow_doctor"},
    {"init", "Write a projector's configuration and a launch file for the robot that runs",
     "afterglow_doctor"},
};

const Verb* findVerb(const std::string& name) {
  const auto* found = std::find_if(std::begin(kVerbs), std::end(kVerbs),
                                   [&](const Verb& verb) { return name == verb.name; });
  return found == std::end(kVerbs) ? nullptr : found;
}

std::vector<std::string> words_behind_dashes;

/// How many words of the command line are the verb's; keeps the others.
int splitAtDashes(int argc, char** argv) {
  const Verb* verb = argc > 1 ? findVerb(argv[1]) : nullptr;
  if (!verb || !verb->runs_command) return argc;
  char** const dashes = std::find(argv, argv + argc, std::string("--"));
  if (dashes != argv + argc) words_behind_dashes.assign(dashes + 1, argv + argc);
  return static_cast<int>(dashes - argv);
}

/// Takes ROS's own word for a namespace, __ns:=/robot2, as $ROS_NAMESPACE from the first words, and
/// returns how many are left.
int takeNamespace(int count, char** argv) {
  const std::string start = "__ns:=";
  char** const end = std::remove_if(argv, argv + count, [&start](const char* word) {
    const bool is_namespace = std::string(word).rfind(start, 0) == 0;
    if (is_namespace) ::setenv("ROS_NAMESPACE", word + start.size(), 1);
    return is_namespace;
  });
  return static_cast<int>(end - argv);
}

void printFailure(const CLI::App& app, std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  std::cerr << "afterglow";
  for (auto verbs = app.get_subcommands(); !verbs.empty();
       verbs = verbs.front()->get_subcommands()) {
    std::cerr << " " << verbs.front()->get_name();
  }
  std::cerr << ": " << text << std::endl;
}

/// "; did you mean WORD?", else the known words.
std::string nearestOf(const std::string& word, const std::vector<std::string>& known) {
  const std::string hint = replay::didYouMean(word, known);
  if (!hint.empty()) return hint;
  std::string all = "; there are:";
  for (const std::string& name : known) all += " " + name;
  return all;
}

/// The innermost verb of the command line that was understood.
const CLI::App& lastVerb(const CLI::App& app) {
  const CLI::App* verb = &app;
  while (!verb->get_subcommands().empty()) verb = verb->get_subcommands().front();
  return *verb;
}

/// For a verb that consists of others, of which the command line names none: what is wrong; empty
/// for another mistake.
std::string missingPart(const CLI::App& verb, int argc, char** argv) {
  std::vector<std::string> known;
  for (const CLI::App* part : verb.get_subcommands([](const CLI::App*) { return true; })) {
    known.push_back(part->get_name());
  }
  char** const end = argv + argc;
  char** word = verb.get_parent() == nullptr ? argv : std::find(argv, end, verb.get_name());
  if (known.empty() || word == end) return "";
  word = std::find_if(word + 1, end, [](const char* text) { return *text != '-'; });
  if (word == end) return "a subcommand is missing" + nearestOf("", known);
  return "there is no subcommand '" + oneLine(*word) + "'" + nearestOf(*word, known);
}

/// For the first option that the verb does not know: the one that it may have been meant for.
std::string nearestOption(const CLI::App& verb, int argc, char** argv) {
  std::vector<std::string> known;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
  }
  for (int i = 1; i < argc; ++i) {
    const std::string word = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
    if (word == "--") break;
    if (word.rfind("--", 0) != 0 || std::count(known.begin(), known.end(), word) > 0) continue;
    return replay::didYouMean(word, known);
  }
  return "";
}

}  // namespace

int runCommand(int argc, char** argv, const std::vector<AddVerb>& verbs) {
  const SafeOutput safe;
  CLI::App app("Records what a robot does, finds it again and replays it with its projection.",
               "afterglow");
  app.set_version_flag("--version", "afterglow " AFTERGLOW_VERSION);
  app.require_subcommand(1);
  for (const AddVerb add : verbs) add(app);
  try {
    app.parse(takeNamespace(splitAtDashes(argc, argv), argv), argv);
    if (!std::cout.flush()) throw std::runtime_error("cannot write to standard output");
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help and --version
      std::ostringstream help;
      app.exit(error, help, help);
      std::cout << wrapped(help.str(), terminalWidth());
      return 0;
    }
    const CLI::App& verb = lastVerb(app);
    std::string text = missingPart(verb, argc, argv);
    if (text.empty()) text = error.what();
    text += nearestOption(verb, argc, argv);
    const bool is_referred = text.find("see --help") != text.npos;
    printFailure(app, text + (is_referred ? "" : "; see --help"));
    return 2;
  } catch (const std::bad_alloc&) {
    printFailure(app, "not enough memory");
  } catch (const std::exception& error) {
    printFailure(app, error.what());
  }
  return 1;
}

const std::vector<std::string>& wordsBehindDashes() { return words_behind_dashes; }

int refuseVerb(const std::string& word) {
  std::vector<std::string> known;
  for (const Verb& verb : kVerbs) known.emplace_back(verb.name);
  std::cerr << "afterglow: there is no verb '" << oneLine(word) << "'" << nearestOf(word, known)
            << std::endl;
  return 2;
}

const char* programOf(const std::string& verb) {
  const Verb* found = findVerb(verb);
  return found ? found->program : nullptr;
}

void addVerbNames(CLI::App& app) {
  for (const Verb& verb : kVerbs) app.add_subcommand(verb.name, verb.help);
}

CLI::App* addVerb(CLI::App& app, const std::string& name) {
  return app.add_subcommand(name, findVerb(name)->help);
}

int becomeProgram(const char* name, const std::string& verb, char** argv) {
  std::error_code ignored;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const std::string path = own.parent_path() / name;
  ::execv(path.c_str(), argv);
  std::cerr << "afterglow " << verb << ": cannot start " << path << ": " << std::strerror(errno)
            << " (nodes/setup builds it)" << std::endl;
  return 1;
}

}  // namespace afterglow::nodes
