/// \file
/// The independent referee of where light lands, tests/referee/procam_sim.py, and of how bright it
/// is together, light_sum.py, which share no code with what they judge.
#pragma once

#include <cstdlib>
#include <string>

namespace afterglow::test {

inline const std::string kReferee = "tests/referee/procam_sim.py";
inline const std::string kLightSum = "tests/referee/light_sum.py";

/// Its exit status; what it says on stderr goes to the end of the log.
inline int runReferee(const std::string& arguments, const std::string& log = "/dev/null",
                      const std::string& program = kReferee) {
  return std::system((program + " " + arguments + " 2>> " + log).c_str());
}

/// Why it cannot judge here, or empty.
inline std::string refereeAbsence() {
  if (runReferee("--help > /dev/null") == 0) return "";
  return kReferee + " does not run: python3-numpy, -opencv or -yaml is missing";
}

}  // namespace afterglow::test
