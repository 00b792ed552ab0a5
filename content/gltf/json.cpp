// SPDX-License-Identifier: Apache-2.0
#include "content/gltf/json.h"

#include "engine/base/error.h"

namespace docent::content {

void Refuse(std::string_view file, std::string_view place, std::string_view what) {
  std::string sentence(file);
  sentence += ": ";
  if (!place.empty()) {
    sentence += place;
    sentence += ' ';
  }
  sentence += what;
  throw Error(sentence);
}

namespace {

// Parses the text once without building a tree, to check that it is JSON within the limits. (The library also
// offers callbacks while it builds the tree, but then it searches each array again for each of its entries.)
class LimitCheck : public nlohmann::json_sax<Json> {
 public:
  LimitCheck(std::string_view file, const LoadLimits& limits) : file_(file), limits_(limits) {}

  bool null() override { return Count(); }
  bool boolean(bool) override { return Count(); }
  bool number_integer(number_integer_t) override { return Count(); }
  bool number_unsigned(number_unsigned_t) override { return Count(); }
  bool number_float(number_float_t, const string_t&) override { return Count(); }
  bool string(string_t&) override { return Count(); }
  bool binary(binary_t&) override { return Count(); }
  bool key(string_t&) override { return Count(); }
  bool start_object(std::size_t) override { return Open(); }
  bool start_array(std::size_t) override { return Open(); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }
  bool parse_error(std::size_t, const std::string&, const Json::exception& fault) override {
    // The library's message contains the byte offset; its prefix "[json.exception…]" is useless to users.
    std::string words = fault.what();
    const std::size_t bracket = words.find("] ");
    if (bracket != std::string::npos) words.erase(0, bracket + 2);
    for (char& letter : words) {
      if (static_cast<unsigned char>(letter) < 0x20) letter = ' ';
    }
    Refuse(file_, "", "the text is not valid JSON (" + words.substr(0, 160) + ").");
  }

 private:
  bool Count() {
    if (++values_ > limits_.max_json_values) {
      Refuse(file_, "",
             "the JSON text has more than " + std::to_string(limits_.max_json_values) + " values.");
    }
    return true;
  }
  bool Open() {
    if (++depth_ > limits_.max_json_depth) {
      Refuse(file_, "",
             "the JSON text is nested deeper than " + std::to_string(limits_.max_json_depth) + " levels.");
    }
    return Count();
  }
  bool Close() {
    --depth_;
    return true;
  }

  std::string_view file_;
  const LoadLimits& limits_;
  std::size_t values_ = 0;
  int depth_ = 0;
};

}  // namespace

Json ParseGltfJson(std::string_view file, std::string_view text, const LoadLimits& limits) {
  if (text.size() > limits.max_json_bytes) {
    Refuse(file, "", "the JSON text is larger than " + std::to_string(limits.max_json_bytes) + " bytes.");
  }
  LimitCheck check(file, limits);
  Json::sax_parse(text, &check);
  Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) Refuse(file, "", "the text is not a JSON object.");
  return json;
}

std::uint64_t UnsignedOr(const Json& object, const char* name, std::uint64_t fallback) {
  const auto found = object.find(name);
  return found == object.end() ? fallback : found->get<std::uint64_t>();
}

std::size_t CountOf(const Json& object, const char* name) {
  return ArrayOf(object, name).size();
}

const Json& ArrayOf(const Json& object, const char* name) {
  static const Json empty = Json::array();
  const auto found = object.find(name);
  return found == object.end() || !found->is_array() ? empty : *found;
}

const Json& ObjectOf(const Json& object, const char* name) {
  static const Json empty = Json::object();
  const auto found = object.find(name);
  return found == object.end() || !found->is_object() ? empty : *found;
}

std::string Place(std::string_view array, std::size_t index) {
  return std::string(array) + "[" + std::to_string(index) + "]";
}

}  // namespace docent::content
