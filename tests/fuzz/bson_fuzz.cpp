// Documents from a server that everybody may write to. An input is a letter, which says of what type
// the message is, and the document.
#include "replay/messages/bson_document.hpp"

#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::bson_fuzz {
namespace {

template <typename Ros>
const replay::Schema& schemaOf() {
  namespace traits = ros::message_traits;
  static const auto schema = replay::Schema::parse(traits::DataType<Ros>::value(),
                                                              traits::Definition<Ros>::value());
  return schema;
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(bson) {
  using namespace replay;
  if (size == 0) return;
  bson_t document;
  if (!bson_init_static(&document, data + 1, size - 1)) return;
  const Schema& schema = data[0] == 'c' ? schemaOf<sensor_msgs::PointCloud2>()
                                        : schemaOf<visualization_msgs::MarkerArray>();
  try {
    encode(schema, messageFromBson(schema, document).document);
  } catch (const MessageError&) {
  }
}

}  // namespace afterglow::fuzz::bson_fuzz
