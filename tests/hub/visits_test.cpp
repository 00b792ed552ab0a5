// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "maps/hub/administration.h"
#include "maps/hub/hub.h"
#include "maps/hub/hub_backup.h"
#include "maps/hub/hub_visits.h"
#include "tests/hub/private_server.h"
#include "tests/maps/map_samples.h"

// Records of visits on a hub, and hubs of the version that had none.
namespace docent::maps {
namespace {

using testing::HasSubstr;

class HubVisits : public WithHubServer {
 protected:
  void Write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((folder_ / file).parent_path());
    WriteWholeFile(folder_ / file,
                   std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }
  std::string Read(const std::string& file) {
    const Bytes bytes = ReadWholeFile(folder_ / file);
    return {bytes.begin(), bytes.end()};
  }
  TemporaryFolder folder_;
};

TEST_F(HubVisits, AreHandedInOnceAndCollectedByCurators) {
  Write("device/visits-2026-11-24.jsonl", "{\"a\": 1}\n{\"a\": 2}\nno record\n");
  Write("device/visits-2026-11-25.jsonl", "{\"a\": 3}\n");
  Write("device/other.jsonl", "{\"a\": 4}\n");
  const std::string visitor = Url(AddUser("vera", "visitor")), curator = Url(AddUser("carl", "curator"));
  const HandedInVisits first = HandInVisits(visitor, folder_ / "device");
  EXPECT_EQ(first.added, 3u);
  EXPECT_EQ(first.skipped, 1u);
  Write("device/visits-2026-11-25.jsonl", "{\"a\": 3}\n{\"a\": 5}\n");
  EXPECT_EQ(HandInVisits(visitor, folder_ / "device").added, 1u);
  EXPECT_THAT(ErrorOf([&] { CollectVisits(visitor, folder_ / "stolen"); }), HasSubstr("may not do this"));
  EXPECT_EQ(CollectVisits(curator, folder_ / "all"), 4u);
  EXPECT_EQ(CollectVisits(curator, folder_ / "all"), 0u);
  EXPECT_EQ(Read("all/visits-2026-11-25.jsonl"), "{\"a\": 3}\n{\"a\": 5}\n");
  EXPECT_EQ(RunHubSql(Url(), "SELECT count(DISTINCT handed_in_by) FROM docent.visits"), "1");
  for (const char* sql :
       {"SELECT * FROM docent.visits", "DELETE FROM docent.visits",
        "SELECT docent.hand_in_visits('[{\"day\": \"x\", \"line\": \"{}\"}]')",
        "SELECT docent.hand_in_visits('[{\"day\": \"2026-01-01\", \"line\": \"x\"}]')",
        "SELECT docent.hand_in_visits('[{\"day\": \"2026-01-01\", \"line\": \"{}\\n{}\"}]')"})
    EXPECT_NE(ErrorOfHubSql(visitor, sql), "") << sql;
}

TEST_F(HubVisits, AreCollectedAfterALineThatAFullDiskHasCutOff) {
  const std::string file = "visits-2026-11-24.jsonl", one = "{\"a\": 1}\n", two = "{\"a\": 2}\n";
  Write("device/" + file, one + two);
  HandInVisits(Url(), folder_ / "device");
  Write("all/" + file, one + "{\"a\"");
  EXPECT_EQ(CollectVisits(Url(), folder_ / "all"), 1u);
  EXPECT_EQ(Read("all/" + file), one + "{\"a\"\n" + two);
  EXPECT_EQ(CollectVisits(Url(), folder_ / "all"), 0u);
  // Of a whole record only the end of its line is missing.
  Write("all/" + file, "{\"a\": 1}");
  EXPECT_EQ(CollectVisits(Url(), folder_ / "all"), 1u);
  EXPECT_EQ(Read("all/" + file), one + two);
}

TEST_F(HubVisits, ARestorationReplacesNoHubThatHasRecords) {
  BackUpHub(Url(), folder_ / "empty.hub");
  Write("device/visits-2026-11-24.jsonl", "{\"a\": 1}\n");
  EXPECT_EQ(HandInVisits(Url(), folder_ / "device").added, 1u);
  EXPECT_THAT(ErrorOf([&] { RestoreHub(Url(), folder_ / "empty.hub"); }), HasSubstr("another database"));
  EXPECT_EQ(RunHubSql(Url(), "SELECT count(*) FROM docent.visits"), "1");
}

TEST_F(HubVisits, AHubOfVersionOneIsUpgraded) {
  const std::string old = server().Url("old-" + Database());
  RunHubSqlAlone(Url(), "CREATE DATABASE \"old-" + Database() + "\"");
  const Bytes script = ReadWholeFile(std::string(DOCENT_SOURCE_DIR) + "/maps/hub/schema/version_1.sql");
  RunHubSql(old, {script.begin(), script.end()});
  EXPECT_THAT(ErrorOf([&] { Hub hub(old); }), HasSubstr("older Docent"));
  const HubInit init = InitHub(old);
  EXPECT_EQ(init.version_before, 1);
  EXPECT_EQ(init.version, kHubVersion);
  EXPECT_EQ(Hub(old).LastChange(), 0);
  Write("device/visits-2026-11-24.jsonl", "{\"a\": 1}\n");
  EXPECT_EQ(HandInVisits(old, folder_ / "device").added, 1u);
}

}  // namespace
}  // namespace docent::maps
