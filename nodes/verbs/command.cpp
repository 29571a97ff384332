#include "nodes/verbs/command.hpp"

#include <unistd.h>

#include <CLI/Config.hpp>  // this and Formatter.hpp: what CLI::App's destructor needs to be linked
#include <CLI/Formatter.hpp>
#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>

namespace afterglow::nodes {
namespace {

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

}  // namespace

int runCommand(int argc, char** argv, const std::vector<AddVerb>& verbs) {
  CLI::App app("Records what a robot does, finds it again and replays it with its projection.",
               "afterglow");
  app.set_version_flag("--version", "afterglow " AFTERGLOW_VERSION);
  app.require_subcommand(1);
  for (const AddVerb add : verbs) add(app);
  try {
    app.parse(argc, argv);
    if (!std::cout.flush()) throw std::runtime_error("cannot write to standard output");
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;  // --help and --version come this way too
  } catch (const std::bad_alloc&) {
    printFailure(app, "not enough memory");
  } catch (const std::exception& error) {
    printFailure(app, error.what());
  }
  return 1;
}

int becomeProgram(const char* name, const char* verb, char** argv) {
  std::error_code ignored;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const std::string path = own.parent_path() / name;
  ::execv(path.c_str(), argv);
  std::cerr << "afterglow " << verb << ": cannot start " << path << ": " << std::strerror(errno)
            << " (nodes/setup builds it)" << std::endl;
  return 1;
}

}  // namespace afterglow::nodes
