/// \file
/// The independent referee of where light lands, tests/referee/procam_sim.py, which shares no code
/// with what it judges.
#pragma once

#include <cstdlib>
#include <string>

namespace afterglow::test {

inline const std::string kReferee = "tests/referee/procam_sim.py";

/// Its exit status; what it says on stderr goes to the end of the log.
inline int runReferee(const std::string& arguments, const std::string& log = "/dev/null") {
  return std::system((kReferee + " " + arguments + " 2>> " + log).c_str());
}

/// Why it cannot judge here, or empty.
inline std::string refereeAbsence() {
  if (runReferee("--help > /dev/null") == 0) return "";
  return kReferee + " does not run: python3-numpy, -opencv or -yaml is missing";
}

}  // namespace afterglow::test
