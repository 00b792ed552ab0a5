// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// What an operator does with a hub. Each function connects by itself and throws docent::Error. Creating a hub
// needs a PostgreSQL user who may create roles; users are managed by admins of the hub.
namespace docent::maps {

// What InitHub has done.
struct HubInit {
  int version_before = 0;         // 0: there was no hub.
  int version = 0;                // Now.
  bool created_database = false;  // It did not exist.
};
// Makes a hub of a database, which is created if it does not exist, or upgrades the hub in it, in one
// transaction.
HubInit InitHub(const std::string& url);

// A user whom AddHubUser made.
struct HubUser {
  std::string name;  // Of the PostgreSQL role.
  std::string role;  // "visitor", "curator" or "admin".
};
// Without a password, the user must be known to the server otherwise (docs/hub.md).
void AddHubUser(const std::string& url, const std::string& name, const std::string& role,
                const std::optional<std::string>& password);
void RemoveHubUser(const std::string& url, const std::string& name);
std::vector<HubUser> ListHubUsers(const std::string& url);

// An entry of the log of changes.
struct HubChange {
  std::int64_t change = 0;  // Its number.
  std::string when, who, what;
  std::string subject;        // The map, tour or user.
  std::int64_t revision = 0;  // Of the map or tour; 0 for none.
};
// How a hub is.
struct HubStatus {
  std::string user, role;  // Who asks. The role is empty for somebody who has none.
  std::int64_t version = 0, maps = 0, tours = 0, revisions = 0;
  std::int64_t kept_revisions = 0;  // Of each map.
  std::int64_t bytes = 0;           // Of the database.
  bool encrypted = false;           // The connection.
  std::vector<HubChange> changes;   // The newest ones, the newest first; only curators and admins see them.
};
HubStatus StatusOf(const std::string& url, int changes);

// Puts the map with this name back to an earlier revision; returns the number of the new one.
std::int64_t RevertHubMap(const std::string& url, const std::string& name, std::int64_t to_revision);

}  // namespace docent::maps
