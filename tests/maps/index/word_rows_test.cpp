// SPDX-License-Identifier: Apache-2.0
#include "maps/index/word_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/exchange/exchange.h"
#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "maps/storage/envelope.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using engine::MakeWordBag;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<engine::KeyFrameWords> WordsIn(const Library& library) {
  std::vector<engine::KeyFrameWords> all;
  library.LoadAppearance([&](const MapInfo&, const Library::Appearance& appearance) {
    EXPECT_EQ(appearance.problem, "");
    all.insert(all.end(), appearance.words.begin(), appearance.words.end());
  });
  return all;
}

constexpr SampleOptions kWithWords = {.keyframes = 3, .width_px = 160, .height_px = 128, .corners = true};

// A new library in which map 1, "Desk", is this map.
Library LibraryOf(const std::filesystem::path& file, const std::shared_ptr<const engine::MapSnapshot>& map) {
  Library library = OpenToWrite(file);
  library.Save({library.NewKey(), "Desk", Policy::kOpen, map, nullptr});
  return library;
}

WordTable SampleTable() {
  return {77,
          {{2, 2, MakeWordBag({1, 1, 5, 4095})},
           {3, 2, {}},
           {9, 9, MakeWordBag(std::vector<std::uint32_t>(40, 8))}}};
}

// A table with keyframe 7 and these numbers for its place and words.
Bytes OneKeyFrame(std::uint32_t place, const std::vector<std::uint16_t>& words) {
  ByteWriter writer = BeginEnvelope(kWordTableKind, 4, 1);
  writer.Put(std::uint64_t{77});
  writer.Put(std::uint32_t{7});
  writer.Put(place);
  writer.Put(static_cast<std::uint16_t>(words.size()));
  for (const std::uint16_t word : words) writer.Put(word);
  return FinishEnvelope(std::move(writer));
}

TEST(WordRows, DecodingInvertsEncoding) {
  EXPECT_EQ(DecodeWords(4, EncodeWords(4, SampleTable())), SampleTable());
  EXPECT_EQ(DecodeWords(4, EncodeWords(4, {77, {}})), (WordTable{77, {}}));
  EXPECT_EQ(DecodeWords(4, OneKeyFrame(7, {5 << 4, 6 << 4 | 15})).keyframes[0].words,
            MakeWordBag({5, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6, 6}));
}

TEST(WordRows, RejectInvalidTables) {
  const auto error = [](const Bytes& bytes) { return ErrorOf([&] { DecodeWords(4, bytes); }); };
  EXPECT_THAT(error(EncodeWords(5, SampleTable())), HasSubstr("belongs to another map"));
  EXPECT_THAT(error(OneKeyFrame(6, {})), HasSubstr("a keyframe has no valid place"));
  EXPECT_THAT(error(OneKeyFrame(8, {})), HasSubstr("a keyframe has no valid place"));
  EXPECT_THAT(error(OneKeyFrame(7, {6 << 4, 5 << 4})), HasSubstr("out of order"));
  EXPECT_THAT(error(OneKeyFrame(7, {6 << 4, 6 << 4 | 1})), HasSubstr("out of order"));
  WordTable table = SampleTable();
  std::swap(table.keyframes[0], table.keyframes[2]);
  EXPECT_THAT(error(EncodeWords(4, table)), HasSubstr("out of order"));
  table = SampleTable();
  table.keyframes[2].place = 3;  // It does not represent a place.
  EXPECT_THAT(error(EncodeWords(4, table)), HasSubstr("a keyframe has no valid place"));
  ByteWriter writer = BeginEnvelope(kWordTableKind, 4, 1'000'000'000);
  writer.Put(std::uint64_t{77});
  EXPECT_THAT(error(FinishEnvelope(std::move(writer))), HasSubstr("its length does not match"));
  Bytes bytes = EncodeWords(4, SampleTable());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    Bytes damaged = bytes;
    damaged[i] ^= 0x10;
    EXPECT_NE(error(damaged), "no error") << i;
  }
}

TEST(WordRows, KeyframesCloseTogetherAreOnePlace) {
  engine::MapSnapshot map;
  const auto add = [&](double x, double turn_rad, double depth) {
    engine::KeyFrame keyframe;
    keyframe.id = 10 * static_cast<engine::KeyFrameId>(map.keyframes.size());
    keyframe.camera_from_map.rotation = engine::Rotation3::Exp({0, turn_rad, 0});
    keyframe.camera_from_map.translation = -(keyframe.camera_from_map.rotation * Eigen::Vector3d(x, 0, 0));
    keyframe.mean_depth = depth;
    map.keyframes.push_back(keyframe);
  };
  add(0.0, 0.0, 2);    // 0: a new place
  add(0.9, 0.0, 2);    // 10: within half of the depth of keyframe 0
  add(1.8, 0.0, 2);    // 20: too far from keyframe 0, although close to keyframe 10
  add(0.0, 0.5, 2);    // 30: rotated by 29 degrees
  add(0.0, 0.7, 2);    // 40: rotated by 40 degrees
  add(0.3, 0.0, 0.5);  // 50: too far for its small depth
  add(1.9, 0.1, 2);    // 60
  EXPECT_THAT(engine::PlacesOf(map), ElementsAre(0, 0, 20, 0, 40, 50, 20));
}

TEST(WordRows, MatchTheKeyframesAfterEverySave) {
  const TemporaryFolder folder;
  auto map = MakeSampleMap(1, kWithWords);
  Library library = LibraryOf(folder / "a.docent", map);
  const std::uint64_t key = library.FindByName("Desk").key;
  const std::vector<engine::KeyFrameWords> first = engine::MakeWords(*map, {});
  EXPECT_EQ(WordsIn(library), first);
  EXPECT_FALSE(first[0].words.empty());
  AddSampleKeyFrame(9, {1, 0, 0}, map.get());
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});
  EXPECT_EQ(WordsIn(library), engine::MakeWords(*map, {}));
  EXPECT_EQ(WordsIn(library).size(), 4u);
  EXPECT_EQ(library.Verify(), std::vector<std::string>{});
  library.Rename(key, "Table");
  EXPECT_EQ(WordsIn(library), engine::MakeWords(*map, {}));
  library.Remove(key);
  EXPECT_THAT(WordsIn(library), IsEmpty());
  EXPECT_EQ(library.Verify(), std::vector<std::string>{});
}

TEST(WordRows, AreKeptForUnchangedImagesAndRecomputedForOthers) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  auto map = MakeSampleMap(1, kWithWords);
  LibraryOf(file, map);
  // Artificial words that no algorithm computes from these images.
  std::vector<engine::KeyFrameWords> marked = engine::MakeWords(*map, {});
  for (engine::KeyFrameWords& words : marked) words.words = MakeWordBag({words.keyframe});
  WriteWords(Database::OpenReadWrite(file, false), 1, marked);
  const engine::KeyFrameId changed = map->keyframes[1].id;
  map->keyframes[1].features = MakeSampleMap(5, kWithWords)->keyframes[1].features;
  Library library = OpenToWrite(file);
  library.Save({1, "Desk", Policy::kOpen, map, nullptr});
  const auto words = WordsIn(library);
  ASSERT_EQ(words.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(words[i].words,
              words[i].keyframe == changed ? engine::WordsOf(*map->keyframes[i].features) : marked[i].words);
  }
}

TEST(WordRows, OfAnotherVocabularyAreIgnored) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  auto map = MakeSampleMap(1, kWithWords);
  Library library = LibraryOf(file, map);
  {
    const Database database = Database::OpenReadWrite(file, false);
    const Bytes bytes = EncodeWords(1, {VocabularyFingerprint() + 1, engine::MakeWords(*map, {})});
    database.Prepare("UPDATE words SET data = ?").Bind(1, std::span<const std::uint8_t>(bytes)).Run();
  }
  EXPECT_THAT(WordsIn(library), IsEmpty());
  EXPECT_EQ(library.Verify(), std::vector<std::string>{});
  // Until the map is saved again.
  AddSampleKeyFrame(9, {1, 0, 0}, map.get());
  library.Save({1, "Desk", Policy::kOpen, map, nullptr});
  EXPECT_EQ(WordsIn(library), engine::MakeWords(*map, {}));
}

TEST(WordRows, VerifyFindsWrongOnes) {
  const TemporaryFolder folder;
  const auto file = folder / "a.docent";
  const auto map = MakeSampleMap(1, kWithWords);
  const auto verified_after = [&](const std::function<void(const Database&)>& change) {
    std::filesystem::remove(file);
    LibraryOf(file, map);
    change(Database::OpenReadWrite(file, false));
    const Library library = OpenToRead(file);
    const auto sentences = library.Verify();
    return sentences.empty() ? std::string("all is well") : sentences.front();
  };
  const std::vector<engine::KeyFrameWords> right = engine::MakeWords(*map, {});
  EXPECT_EQ(verified_after([&](const Database&) {}), "all is well");
  EXPECT_THAT(verified_after([](const Database& d) { d.Execute("DELETE FROM words"); }),
              HasSubstr("map 'Desk' (1): its words are missing"));
  EXPECT_THAT(verified_after([](const Database& d) { d.Execute("UPDATE words SET data = x'00'"); }),
              HasSubstr("the table of words is cut off"));
  EXPECT_THAT(
      verified_after([](const Database& d) { d.Execute("INSERT INTO words SELECT 9, data FROM words"); }),
      HasSubstr("belong to no map"));
  EXPECT_THAT(verified_after([&](const Database& d) {
                WriteWords(d, 1, {right.begin(), right.end() - 1});
              }),
              HasSubstr("the number of its words' keyframes differs from that of its keyframes"));
  EXPECT_THAT(verified_after([&](const Database& d) {
                auto others = right;
                for (auto& words : others) words.place = words.keyframe;
                others.back().keyframe = others.back().place = 1000;
                WriteWords(d, 1, others);
              }),
              HasSubstr("its words belong to other keyframes"));
}

TEST(WordRows, AreKeptByExportImportAndRecovery) {
  const TemporaryFolder folder;
  ExportMap(LibraryOf(folder / "a.docent", MakeSampleMap(1, kWithWords)), 1, folder / "exported.docent");
  const auto open = [&](const char* name) { return OpenToRead(folder / name); };
  ImportMaps(open("a.docent"), folder / "imported.docent");
  RunSql(folder / "a.docent", "UPDATE words SET data = x'00'");
  Recover(folder / "a.docent", folder / "recovered.docent");
  const std::vector<engine::KeyFrameWords> words = engine::MakeWords(*MakeSampleMap(1, kWithWords), {});
  EXPECT_FALSE(words[0].words.empty());
  for (const char* name : {"exported.docent", "imported.docent", "recovered.docent"}) {
    EXPECT_EQ(WordsIn(open(name)), words) << name;
    EXPECT_EQ(open(name).Verify(), std::vector<std::string>{}) << name;
  }
}

}  // namespace
}  // namespace docent::maps
