// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <array>
#include <cstring>

#include "maps/hub/administration.h"
#include "maps/hub/hub.h"
#include "maps/hub/sha256.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// Attempts to break into a hub: by hand-written SQL of each role, through names, and from the server's side.
namespace docent::maps {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class HubRoles : public WithHubServer {
 protected:
  // A hub with a map that has this policy, saved by the owner.
  void AddMap(Policy policy) {
    {
      Library library = OpenSampleLibrary(folder_ / "own");
      AddSampleMap(&library, "Desk", 3, policy);
    }
    Push(SampleSync(Url(), folder_ / "own"));
    head_ = Hub(Url()).Heads().at(0);
  }
  // The map as a library of this user has it after `edit`, sent with hand-written facts and items.
  std::string ErrorOfSave(const std::string& user, const std::function<void(LocalMap*)>& change) {
    Hub hub(Url(user));
    const HubRevision revision = *hub.Revision(head_.id, head_.revision);
    LocalMap map{revision.facts, revision.manifest, {}, {}};
    change(&map);
    return ErrorOf([&] {
      for (const auto& [item, bytes] : map.items) {
        hub.PutBlob(bytes);
        map.manifest[item] = HashOf(bytes);
      }
      hub.SaveMap(head_.id, head_.revision, map.facts, map.manifest);
    });
  }
  // The table of keyframes with one more at this place, and its image.
  void AddKeyFrame(const std::string& user, const Eigen::Vector3d& center, LocalMap* map) {
    const Bytes stored = Hub(Url(user)).Blob(map->manifest.at("keyframes"));
    const std::vector<std::uint8_t>::difference_type record = 98, header = 24;
    Bytes last(stored.end() - 8 - record, stored.end() - 8);
    const std::uint32_t id = map->facts.info.next_keyframe++;
    std::memcpy(last.data(), &id, sizeof id);
    const std::array<double, 7> pose{0, 0, 0, 1, -center.x(), -center.y(), -center.z()};
    std::memcpy(last.data() + 18, pose.data(), sizeof pose);
    Bytes more = stored;
    more.insert(more.end() - 8, last.begin(), last.end());
    const std::uint64_t count = ++map->facts.info.keyframes;
    std::memcpy(more.data() + header - 8, &count, sizeof count);
    map->items["keyframes"] = more;
    map->items["image/" + std::to_string(id)] = Bytes(40, 7);
  }

  TemporaryFolder folder_;
  HubHead head_;
};

TEST_F(HubRoles, AVisitorReadsAndWritesNothing) {
  AddMap(Policy::kOpen);
  const std::string visitor = Url(AddUser("vera", "visitor"));
  EXPECT_EQ(RunHubSql(visitor, "SELECT name FROM docent.maps"), "Desk");
  for (const char* sql : {"INSERT INTO docent.maps SELECT gen_random_uuid(), 5, 1, 99, 'Mine', false",
                          "UPDATE docent.maps SET name = 'X'",
                          "DELETE FROM docent.maps",
                          "DELETE FROM docent.revisions",
                          "DELETE FROM docent.items",
                          "DELETE FROM docent.blobs",
                          "UPDATE docent.hub SET version = 9",
                          "INSERT INTO docent.changes VALUES (99, now(), 'me', 'x', NULL, NULL, 'y')",
                          "TRUNCATE docent.maps CASCADE",
                          "DROP SCHEMA docent CASCADE",
                          "SELECT docent.put_blob('x')",
                          "SELECT docent.save_map(gen_random_uuid(), 0, '{}', '{}')",
                          "SELECT docent.remove_map(id, revision) FROM docent.maps",
                          "SELECT docent.revert_map(id, 1, 1) FROM docent.maps",
                          "SELECT docent.save_tour('T', 0, '', 0, '[]')",
                          "SELECT docent.add_user('mallory', 'admin')",
                          "SELECT docent.remove_user('postgres')",
                          "SELECT docent.log_change('forged', NULL, NULL, 'x')",
                          "SELECT docent.publish(r, 'x') FROM docent.revisions r",
                          "SELECT * FROM docent.changes",
                          "SELECT * FROM docent.users",
                          "CREATE TABLE docent.mine (x int)",
                          "CREATE TABLE public.mine (x int)",
                          "CREATE TEMP TABLE mine (x int)",
                          "SET ROLE docent_curator",
                          "GRANT docent_admin TO CURRENT_USER",
                          "ALTER ROLE CURRENT_USER SUPERUSER",
                          "COPY docent.maps TO PROGRAM 'cat'",
                          "SELECT pg_read_file('postgresql.conf')"}) {
    EXPECT_THAT(ErrorOfHubSql(visitor, sql), Not(IsEmpty())) << sql;
  }
  EXPECT_EQ(RunHubSql(Url(), "SELECT count(*) FROM docent.maps"), "1");
}

TEST_F(HubRoles, AVisitorDoesNotSeeEarlierRevisionsOrRemovedMaps) {
  AddMap(Policy::kOpen);
  {
    Library library = OpenSampleLibrary(folder_ / "own");
    EditScene(&library, library.FindByName("Desk").key,
              [](content::Scene* scene) { scene->entities[0].signpost.text = "Secret removed"; });
  }
  Push(SampleSync(Url(), folder_ / "own"));
  const std::string visitor = Url(AddUser("vera", "visitor")), curator = Url(AddUser("carl", "curator"));
  const std::string count = "SELECT count(*) FROM docent.revisions";
  EXPECT_EQ(RunHubSql(visitor, count), "1");
  EXPECT_EQ(RunHubSql(curator, count), "2");
  const std::string blobs = "SELECT count(*) FROM docent.blobs";
  EXPECT_LT(std::stoi(RunHubSql(visitor, blobs)), std::stoi(RunHubSql(curator, blobs)));
  RunHubSql(curator, "SELECT docent.remove_map(id, revision) FROM docent.maps");
  EXPECT_EQ(RunHubSql(visitor, count), "0");
  EXPECT_EQ(RunHubSql(visitor, blobs), "0");
}

TEST_F(HubRoles, ACuratorWritesOnlyThroughTheFunctions) {
  AddMap(Policy::kOpen);
  const std::string curator = Url(AddUser("carl", "curator"));
  for (const char* sql :
       {"UPDATE docent.maps SET name = 'X'", "UPDATE docent.revisions SET policy = 'open'",
        "DELETE FROM docent.items", "INSERT INTO docent.blobs VALUES ('x', 'y', now())",
        "UPDATE docent.changes SET made_by = 'anna'",
        "INSERT INTO docent.changes VALUES (99, now(), 'anna', 'saved', NULL, NULL, 'Desk')",
        "DELETE FROM docent.changes", "SELECT docent.log_change('saved', NULL, NULL, 'forged')",
        "SELECT docent.publish(r, 'x') FROM docent.revisions r", "SELECT docent.prune(id) FROM docent.maps",
        "SELECT docent.add_user('mallory', 'curator')", "SELECT docent.set_password('postgres', 'x')",
        "UPDATE docent.hub SET kept_revisions = 2"}) {
    EXPECT_THAT(ErrorOfHubSql(curator, sql), Not(IsEmpty())) << sql;
  }
}

TEST_F(HubRoles, NobodyChangesTheLog) {
  AddMap(Policy::kOpen);
  for (const char* sql :
       {"UPDATE docent.changes SET made_by = 'anna'", "DELETE FROM docent.changes", "TRUNCATE docent.changes",
        "UPDATE docent.revisions SET name = 'X'", "UPDATE docent.items SET blob = blob"})
    EXPECT_THAT(ErrorOfHubSql(Url(), sql), HasSubstr("never changed")) << sql;
}

TEST_F(HubRoles, TheLogSaysWhoWasLoggedIn) {
  AddMap(Policy::kOpen);
  const std::string carl = AddUser("carl", "curator");
  RunHubSql(Url(carl), "SET application_name = 'x'; SELECT docent.remove_map(id, revision) FROM docent.maps");
  EXPECT_EQ(
      RunHubSql(Url(), "SELECT made_by || ' ' || what FROM docent.changes ORDER BY change DESC LIMIT 1"),
      carl + " removed");
  const HubStatus status = StatusOf(Url(carl), 5);
  EXPECT_EQ(status.role, "curator");
  ASSERT_FALSE(status.changes.empty());
  EXPECT_EQ(status.changes[0].who, carl);
}

TEST_F(HubRoles, AReadOnlyMapStaysAsItIs) {
  AddMap(Policy::kReadOnly);
  const std::string carl = AddUser("carl", "curator");
  EXPECT_THAT(ErrorOfSave(carl,
                          [](LocalMap* map) {
                            map->items["scene"] = {'{', '}'};
                          }),
              HasSubstr("its content cannot be changed"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->facts.info.name = "Mine"; }),
              HasSubstr("cannot be renamed"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->items["mesh"] = Bytes(40, 1); }),
              HasSubstr("its mesh"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->items["thumbnails"] = Bytes(40, 1); }),
              HasSubstr("appearance"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { ++map->facts.info.next_point; }),
              HasSubstr("keyframes and points"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->facts.info.policy = Policy::kOpen; }),
              HasSubstr("no admin"));
  EXPECT_THAT(ErrorOfHubSql(Url(carl), "SELECT docent.remove_map(id, revision) FROM docent.maps"),
              HasSubstr("cannot be removed"));
  const std::string ada = AddUser("ada", "admin");
  EXPECT_EQ(ErrorOfSave(ada, [](LocalMap* map) { map->facts.info.policy = Policy::kOpen; }), "");
}

TEST_F(HubRoles, AnAugmentOnlyMapGetsContentOnly) {
  AddMap(Policy::kAugmentOnly);
  const std::string carl = AddUser("carl", "curator");
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->items["image/0"] = Bytes(40, 1); }),
              HasSubstr("keyframes and points"));
  EXPECT_THAT(ErrorOfSave(carl,
                          [&](LocalMap* map) {
                            AddKeyFrame(carl, {0, 0, 0}, map);
                          }),
              HasSubstr("keyframes and points"));
  EXPECT_THAT(ErrorOfHubSql(Url(carl), "SELECT docent.remove_map(id, revision) FROM docent.maps"),
              HasSubstr("cannot be removed"));
  EXPECT_EQ(ErrorOfSave(carl, [](LocalMap* map) { map->items["scene"] = {'{', '}'}; }), "");
}

TEST_F(HubRoles, ABoundedMapIsExtendedOnlyWithinItsBounds) {
  AddMap(Policy::kBounded);
  const std::string carl = AddUser("carl", "curator");
  const Bounds bounds = *Hub(Url(carl)).Revision(head_.id, 1)->facts.info.bounds;
  const Eigen::Vector3d size = bounds.max - bounds.min;
  EXPECT_THAT(ErrorOfSave(carl,
                          [&](LocalMap* map) {
                            AddKeyFrame(carl, bounds.max + 0.06 * Eigen::Vector3d(size.norm(), 0, 0), map);
                          }),
              HasSubstr("outside its bounds"));
  EXPECT_THAT(ErrorOfSave(carl,
                          [&](LocalMap* map) {
                            AddKeyFrame(carl, bounds.max + size, map);
                            map->facts.info.bounds = Bounds{bounds.min, bounds.max + size};
                          }),
              HasSubstr("bounds can only be changed"));
  EXPECT_EQ(
      ErrorOfSave(carl, [&](LocalMap* map) { AddKeyFrame(carl, 0.5 * (bounds.min + bounds.max), map); }), "");
}

TEST_F(HubRoles, AMapWhosePartsDoNotFitIsRefused) {
  AddMap(Policy::kOpen);
  const std::string carl = AddUser("carl", "curator");
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->manifest.erase("points"); }), HasSubstr("missing"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { ++map->facts.info.points; }),
              HasSubstr("another number"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->items["points"] = Bytes(40, 0); }),
              HasSubstr("not of its kind"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->manifest.erase("image/0"); }), HasSubstr("images"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->items["image/4000000000"] = Bytes(40, 1); }),
              HasSubstr("images"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->items["../../etc/passwd"] = Bytes(40, 1); }),
              HasSubstr("not valid"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->manifest["scene"] = HashOf("not there"); }),
              HasSubstr("not valid"));
  EXPECT_THAT(ErrorOfSave(carl, [](LocalMap* map) { map->facts.asset_names["abcdef"] = "x"; }),
              HasSubstr("assets"));
  EXPECT_EQ(RunHubSql(Url(), "SELECT revision FROM docent.maps"), "1");
}

TEST_F(HubRoles, NamesAreNeverPartOfAStatement) {
  const std::string name = "'); DROP SCHEMA docent CASCADE; --\"$1\\";
  {
    Library library = OpenSampleLibrary(folder_ / "own");
    const std::uint64_t key = AddSampleMap(&library, name, 3);
    library.ChangeTours([&](std::vector<Tour>* tours) { tours->push_back({name, {key}, "", 0}); });
  }
  EXPECT_EQ(Push(SampleSync(Url(), folder_ / "own")).problems, 0);
  Pull(SampleSync(Url(), folder_ / "copy"));
  EXPECT_EQ(NamesIn(OpenSampleLibrary(folder_ / "copy")), name);
  EXPECT_EQ(OpenSampleLibrary(folder_ / "copy").Tours().at(0).name, name);
  for (const char* user :
       {"a; DROP SCHEMA docent", "a\"; --", "'", "Anna", "docent_admin", "pg_monitor", "", "public"})
    EXPECT_THAT(ErrorOf([&] { AddHubUser(Url(), user, "admin", std::nullopt); }),
                HasSubstr("name has 1 to 63"))
        << user;
  EXPECT_THAT(ErrorOf([&] { AddHubUser(Url(), "mallory", "admin; x", std::nullopt); }), HasSubstr("role is"));
  EXPECT_THAT(ErrorOf([&] { RemoveHubUser(Url(), "postgres"); }), HasSubstr("no user"));
}

TEST_F(HubRoles, AdminsManageUsers) {
  const std::string ada = AddUser("ada", "admin");
  AddHubUser(Url(ada), "vic-" + ada, "visitor", "correct horse");
  const std::vector<HubUser> users = ListHubUsers(Url(ada));
  EXPECT_THAT(users, testing::Contains(testing::Field(&HubUser::name, "vic-" + ada)));
  EXPECT_THAT(RunHubSql(Url(), "SELECT rolpassword FROM pg_authid WHERE rolname = 'vic-" + ada + "'"),
              testing::StartsWith("SCRAM-SHA-256$"));
  RemoveHubUser(Url(ada), "vic-" + ada);
  EXPECT_THAT(ListHubUsers(Url(ada)), Not(testing::Contains(testing::Field(&HubUser::name, "vic-" + ada))));
}

TEST_F(HubRoles, AHostileServerChangesNothingHere) {
  AddMap(Policy::kOpen);
  const std::vector<std::pair<const char*, const char*>> attacks = {
      {"another image under the hash",
       "UPDATE docent.blobs SET data = 'x' WHERE hash = (SELECT blob FROM docent.items "
       "WHERE item = 'image/0' LIMIT 1)"},
      {"a damaged column",
       "WITH b AS (SELECT convert_to(repeat('x', 200), 'UTF8') AS d), i AS (INSERT INTO docent.blobs "
       "SELECT encode(sha256(d), 'hex'), d, now() FROM b RETURNING hash) UPDATE docent.items SET blob = "
       "(SELECT hash FROM i) WHERE item = 'points'"},
      {"an unknown part", "UPDATE docent.items SET item = '../../x' WHERE item = 'points'"},
      {"a count", "UPDATE docent.revisions SET points = 4000000000"},
      {"a negative count", "UPDATE docent.revisions SET points = -1"},
      {"a policy", "UPDATE docent.revisions SET policy = 'none'"},
      {"a name", "UPDATE docent.revisions SET name = E'x\\ny'"},
      {"bounds", "UPDATE docent.revisions SET bounds = ARRAY['NaN',0,0,1,1,1]::double precision[]"}};
  for (const auto& [what, sql] : attacks) {
    // A server may send anything: its own checks are switched off, and the change is made.
    const std::string copy = "hostile" + std::to_string(&sql - &attacks[0].second);
    RunHubSqlAlone(server().Url("postgres"), "DROP DATABASE IF EXISTS \"" + copy + "\"");
    RunHubSqlAlone(server().Url("postgres"),
                   "CREATE DATABASE \"" + copy + "\" TEMPLATE \"" + Database() + "\"");
    RunHubSql(
        server().Url(copy),
        "SET session_replication_role = replica; ALTER TABLE docent.blobs DROP CONSTRAINT blobs_check, DROP "
        "CONSTRAINT IF EXISTS blobs_hash_check; ALTER TABLE docent.items DROP CONSTRAINT items_item_check; "
        "ALTER "
        "TABLE docent.revisions DROP CONSTRAINT revisions_points_check, DROP CONSTRAINT "
        "revisions_policy_check, DROP "
        "CONSTRAINT revisions_name_check, DROP CONSTRAINT revisions_bounds_check, DROP CONSTRAINT "
        "revisions_check; " +
            std::string(sql));
    const std::filesystem::path library = folder_ / copy;
    SyncReport report;
    const std::string error = ErrorOf([&] { report = Pull(SampleSync(server().Url(copy), library)); });
    EXPECT_TRUE(!error.empty() || report.problems > 0) << what;
    EXPECT_EQ(NamesIn(OpenSampleLibrary(library)), "") << what << " was believed";
    EXPECT_THAT(OpenSampleLibrary(library).Verify(), IsEmpty()) << what;
  }
}

TEST_F(HubRoles, ADatabaseWithoutAHubIsNamed) {
  EXPECT_THAT(ErrorOf([&] { Hub hub(server().Url("postgres")); }), HasSubstr("contains no hub"));
  EXPECT_EQ(InitHub(Url()).version_before, kHubVersion) << "a second init changes nothing";
  RunHubSql(Url(), "UPDATE docent.hub SET version = 99");
  EXPECT_THAT(ErrorOf([&] { Hub hub(Url()); }), HasSubstr("newer Docent"));
  EXPECT_THAT(ErrorOf([&] { InitHub(Url()); }), HasSubstr("newer Docent"));
}

TEST_F(HubRoles, OldRevisionsAreForgotten) {
  AddMap(Policy::kOpen);
  RunHubSql(Url(), "UPDATE docent.hub SET kept_revisions = 3");
  for (int round = 0; round < 6; ++round) {
    Library library = OpenSampleLibrary(folder_ / "own");
    EditScene(&library, library.FindByName("Desk").key,
              [&](content::Scene* scene) { scene->entities[0].signpost.text = std::to_string(round); });
    Push(SampleSync(Url(), folder_ / "own"));
    RunHubSql(Url(), "UPDATE docent.blobs SET used_at = now() - interval '2 days'");
  }
  EXPECT_EQ(RunHubSql(Url(), "SELECT min(revision) || ' ' || max(revision) FROM docent.revisions"), "5 7");
  EXPECT_EQ(
      RunHubSql(Url(),
                "SELECT count(*) FROM docent.blobs b WHERE NOT EXISTS (SELECT FROM docent.items WHERE blob = "
                "b.hash)"),
      "0");
  EXPECT_THAT(ErrorOf([&] { RevertHubMap(Url(), "Desk", 1); }), HasSubstr("no revision 1"));
}

TEST(HubAddress, RefusesWhatIsNotSafe) {
  for (const char* url : {"postgresql://anna@museum.example/docent?sslmode=disable",
                          "postgresql://anna@museum.example/docent?sslmode=allow",
                          "postgresql://anna@192.0.2.1/docent?sslmode=prefer",
                          "postgresql://anna@localhost,museum.example/docent?sslmode=disable",
                          "postgresql://anna@localhost/docent?hostaddr=192.0.2.1&sslmode=disable",
                          "postgresql:///docent?service=museum&sslmode=disable"})
    EXPECT_THAT(ErrorOf([&] { CheckedHubAddress(url); }), HasSubstr("needs an encrypted connection")) << url;
  EXPECT_THAT(ErrorOf([&] { CheckedHubAddress("postgresql://anna:secret@localhost/docent"); }),
              testing::AllOf(HasSubstr("contains a password"), Not(HasSubstr("secret"))));
  EXPECT_THAT(ErrorOf([&] { CheckedHubAddress("museum.docent"); }), HasSubstr("begins with postgresql://"));
  EXPECT_THAT(ErrorOf([&] { CheckedHubAddress("postgresql://[::1/x"); }), HasSubstr("not valid"));
}

TEST(HubAddress, AsksForTlsBeyondThisMachine) {
  EXPECT_THAT(CheckedHubAddress("postgresql://anna@museum.example/docent"), HasSubstr("sslmode='require'"));
  EXPECT_THAT(CheckedHubAddress("postgresql://anna@museum.example/docent?sslmode=verify-full"),
              HasSubstr("sslmode='verify-full'"));
  EXPECT_THAT(CheckedHubAddress("postgresql:///docent?service=museum"), HasSubstr("sslmode='require'"));
  for (const char* url : {"postgresql:///docent", "postgresql://127.0.0.1/docent",
                          "postgresql://[::1]/docent", "postgresql://%2Frun%2Fpostgresql/docent"})
    EXPECT_THAT(CheckedHubAddress(url), Not(HasSubstr("sslmode"))) << url;
}

}  // namespace
}  // namespace docent::maps
