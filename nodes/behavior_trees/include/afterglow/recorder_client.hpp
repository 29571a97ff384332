/// \file
/// The interface between behaviors and recorder_node.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// A behavior to record; visitRecordingFields() names and explains what a recorder is told of it.
struct RecordingOptions {
  std::string name = {};                  ///< "pick"
  std::vector<std::string> topics = {};   ///< absolute names; they need not be announced yet
  std::vector<std::string> regexes = {};  ///< and every topic that one of these matches as a whole
  bool all = false;                       ///< true: all topics but the recorder's exceptions
  std::vector<std::string> exclude = {};  ///< exceptions from `regexes` and `all`
  std::vector<std::string> limits = {};  ///< "/scan every=5", "/points max_hz=2"
  /// Place in the behavior tree; behaviors nest by it. Empty: the name, below the path of this
  /// thread's EnclosingRecording.
  std::string tree_path = {};
  std::string parameters = {};  ///< JSON object; may be empty
  std::vector<std::string> tags = {};
  int attempt = 1;
  double pre_roll_s = 0.0;   ///< begins up to so many seconds earlier
  std::string keep_if = {};  ///< "failure,halted": kept only with such an outcome; empty: always
  /// The behavior begins only when every subscription stands.
  bool wait = true;
  /// Neither the start nor the end holds anybody up longer than this.
  double timeout_s = 5.0;
  /// No behavior without its recording. Otherwise it goes on unrecorded, with a warning.
  bool required = false;
};

/// A field of what a recording can be asked for.
struct RecordingField {
  const char* name;  ///< name in messages and as a port of `<RecordBehavior>`
  const char* help;
  const char* separators = "";  ///< separators of a list that is written as one text
};

template <typename Message>
auto& preRollOf(Message& message) {
  return message.pre_roll;
}
inline double& preRollOf(RecordingOptions& options) { return options.pre_roll_s; }
inline const double& preRollOf(const RecordingOptions& options) { return options.pre_roll_s; }

/// The one table of these fields: visit(field, request.FIELD...) for each of them, of one or
/// several requests. Requests are RecordingOptions, RecordBehavior goals and StartRecording
/// requests.
template <typename Visit, typename... Requests>
void visitRecordingFields(const Visit& visit, Requests&&... requests) {
  using Field = RecordingField;
  visit(Field{"name", "what the behavior is called"}, requests.name...);
  visit(Field{"topics", "names; they need not be announced yet", " \t\r\n,;"}, requests.topics...);
  visit(Field{"regexes", "and topics that one of these matches as a whole", " \t\r\n;"},
        requests.regexes...);
  visit(Field{"all", "every topic but /clock, /rosout and /rosout_agg"}, requests.all...);
  visit(Field{"exclude", "of regexes and all, none that one of these matches", " \t\r\n;"},
        requests.exclude...);
  visit(Field{"limits", "\"/points max_hz=2; /scan every=5\"", ";"}, requests.limits...);
  visit(Field{"tree_path", "place in the tree; empty: below the enclosing recording, by name"},
        requests.tree_path...);
  visit(Field{"parameters", "a JSON object"}, requests.parameters...);
  visit(Field{"tags", "words to find it by", " \t\r\n,;"}, requests.tags...);
  visit(Field{"attempt", "1 for the first try; 0: counted"}, requests.attempt...);
  visit(Field{"pre_roll", "seconds to begin earlier"}, preRollOf(requests)...);
  visit(Field{"keep_if", "outcomes to keep, e.g. \"failure,halted\"; empty: all"},
        requests.keep_if...);
}

template <typename From, typename To>
void copyRecordingFields(const From& from, To& to) {
  visitRecordingFields(
      [](const RecordingField&, const auto& asked, auto& copy) { copy = asked; }, from, to);
}

/// There is no recorder to ask.
class RecorderAbsent : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Starts and stops recordings. Any thread; calls may take as long as the recorder takes.
class RecorderClient {
 public:
  virtual ~RecorderClient() = default;
  /// Returns the behavior's id when its recording stands. Throws RecorderAbsent, or
  /// std::runtime_error with the recorder's reason.
  virtual std::int64_t start(const RecordingOptions& options) = 0;
  /// Throws std::runtime_error.
  virtual void stop(std::int64_t behavior_id, const std::string& outcome) = 0;
};

/// Asks a recorder_node by its services. A recorder that is not there is waited for once, for the
/// recording's timeout; the next recordings only look. ros::init comes first.
std::shared_ptr<RecorderClient> rosRecorder(const std::string& node = "recorder_node");

}  // namespace afterglow::nodes
