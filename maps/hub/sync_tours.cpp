// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <sstream>

#include "maps/hub/restored_links.h"
#include "maps/hub/sync_session.h"
#include "maps/library/map_names.h"
#include "maps/storage/tour_rows.h"

namespace docent::maps {

namespace {

// What a tour is besides its name, as one text.
std::string ContentOf(const HubTour& tour) {
  std::string text = tour.language + "\n" + std::to_string(tour.minutes);
  for (const std::string& stop : tour.stops) text += "\n" + stop;
  return text;
}

// What a tour of this content has become here by the removal of maps.
std::string WithoutLostStops(const SyncSession& session, const std::string& content) {
  constexpr int kLinesBeforeStops = 2;
  std::istringstream lines(content);
  std::string left;
  std::string line;
  for (int i = 0; std::getline(lines, line); ++i) {
    if (i >= kLinesBeforeStops) {
      const MapLink* link = session.LinkTo(line);
      if (link == nullptr || session.local().StampOf(link->key).empty()) continue;
    }
    left += (i == 0 ? "" : "\n") + line;
  }
  return left;
}

// The tour as the hub has it; empty if a stop is not on the hub yet.
std::optional<HubTour> ForHub(const SyncSession& session, const Tour& tour) {
  HubTour on_hub{tour.name, 0, tour.language, tour.minutes, {}, false};
  for (const std::uint64_t stop : tour.stops) {
    const MapLink* link = session.LinkOf(stop);
    if (link == nullptr || link->revision == 0) return std::nullopt;
    on_hub.stops.push_back(link->id);
  }
  return on_hub;
}

// The tour as the library has it, without stops at maps that are not here.
Tour ForLibrary(SyncSession* session, const HubTour& tour) {
  Tour here{tour.name, {}, tour.language, tour.minutes};
  for (const std::string& stop : tour.stops) {
    const MapLink* link = session->LinkTo(stop);
    if (link != nullptr && !session->local().StampOf(link->key).empty()) here.stops.push_back(link->key);
  }
  return here;
}

template <typename Items>
auto TourNamed(const Items& items, const std::string& name) {
  const auto found =
      std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

// What was agreed on about tours, without what the hub has lost.
std::vector<TourLink> TourLinks(SyncSession* session, const std::vector<HubTour>& theirs) {
  std::vector<TourLink> links = session->state().Tours();
  ForgetLostRevisions(session->restorations(), theirs, session->hub().may_save(), &links);
  return links;
}

std::vector<Tour> LocalTours(SyncSession* session) {
  std::vector<std::string> problems;
  std::vector<Tour> tours = session->local().library().Tours(&problems);
  for (const std::string& problem : problems) session->SayProblem(problem);
  return tours;
}

// Puts a tour into the library in the place of the one with its name, or removes that.
void ReplaceTour(SyncSession* session, const std::string& name, const Tour* with) {
  session->local().library().ChangeTours([&](std::vector<Tour>* tours) {
    std::erase_if(*tours, [&](const Tour& tour) { return tour.name == name; });
    if (with != nullptr) tours->push_back(*with);
  });
}

// Gives a tour of the library another name, because the hub has another one of that name.
std::string MoveAside(SyncSession* session, const std::string& name, const std::vector<HubTour>& theirs) {
  std::set<std::string> taken;
  for (const HubTour& tour : theirs) taken.insert(tour.name);
  std::string other;
  session->local().library().ChangeTours([&](std::vector<Tour>* tours) {
    for (const Tour& tour : *tours) taken.insert(tour.name);
    other = FreeName(name, taken);
    for (Tour& tour : *tours) {
      if (tour.name == name) tour.name = other;
    }
  });
  session->Say("The tour '" + name + "' was changed both here and on the hub, so both are kept; '" + name +
               "' is the hub's, and '" + other + "' the one from here.");
  return other;
}

// Whether a tour of the hub stops at a map that was removed here and is still on the hub.
bool HasStopToRemove(const SyncSession& session, const HubTour& tour) {
  return std::any_of(tour.stops.begin(), tour.stops.end(), [&](const std::string& stop) {
    const MapLink* link = session.LinkTo(stop);
    const HubHead* head = session.HeadOf(stop);
    return link != nullptr && link->revision > 0 && session.local().StampOf(link->key).empty() &&
           head != nullptr && !head->removed;
  });
}

void PushTour(SyncSession* session, const Tour& tour, const std::vector<HubTour>& theirs,
              const TourLink* link, bool may_remove) {
  std::optional<HubTour> mine = ForHub(*session, tour);
  if (!mine) {
    session->SayProblem("The tour '" + tour.name +
                        "' stops at a map that is not on the hub, and stays here only");
    return;
  }
  const HubTour* on_hub = TourNamed(theirs, tour.name);
  const std::string content = ContentOf(*mine);
  if (link != nullptr && link->content == content) return;
  if (session->options().remove && !may_remove && on_hub != nullptr && !on_hub->removed &&
      HasStopToRemove(*session, *on_hub)) {
    session->SayProblem("The tour '" + tour.name +
                        "' stays on the hub as it is there until every map is saved there");
    return;
  }
  std::int64_t base = on_hub == nullptr ? 0 : on_hub->revision;
  // Nobody has changed it here: the next pull brings what the hub has.
  if (link != nullptr && link->revision != base && WithoutLostStops(*session, link->content) == content)
    return;
  if (on_hub != nullptr && !on_hub->removed && ContentOf(*on_hub) != content) {
    if (link == nullptr || link->revision != base) {
      mine->name = MoveAside(session, tour.name, theirs);
      base = 0;
    }
  } else if (on_hub != nullptr && !on_hub->removed) {
    session->PutTour(TourLink{tour.name, base, content, session->hub().restoration()});
    return;
  }
  session->hub().SaveTour(*mine, base);
  session->PutTour(TourLink{mine->name, base + 1, content, session->hub().restoration()});
  session->Say("The tour '" + mine->name + "' was saved on the hub");
}

void PullTour(SyncSession* session, const HubTour& theirs, const std::vector<Tour>& tours,
              const std::vector<HubTour>& all, const TourLink* link) {
  const Tour* here = TourNamed(tours, theirs.name);
  std::string content;
  if (here != nullptr) {
    const std::optional<HubTour> mine = ForHub(*session, *here);
    content = mine ? ContentOf(*mine) : "not on the hub";
  }
  // A map that was removed on the hub has just been removed from the tours here.
  const bool is_unchanged =
      link != nullptr && (link->content == content || WithoutLostStops(*session, link->content) == content);
  if (link != nullptr && link->revision == theirs.revision && (is_unchanged || here == nullptr)) {
    // A map that was missing then may be here now.
    if (here == nullptr || ForLibrary(session, theirs) == *here) return;
  }
  if (theirs.removed) {
    if (here != nullptr && is_unchanged) ReplaceTour(session, theirs.name, nullptr);
    if (link != nullptr) session->RemoveTour(theirs.name);
    return;
  }
  if (const std::string fault = ProblemOf(Tour{theirs.name, {}, theirs.language, theirs.minutes});
      !fault.empty())
    throw Error(fault);
  const bool is_equal = here != nullptr && content == ContentOf(theirs);
  if (here != nullptr && !is_unchanged && !is_equal) {
    if (link != nullptr && link->revision == theirs.revision) return;  // Still to be pushed.
    MoveAside(session, theirs.name, all);
  }
  const Tour wanted = ForLibrary(session, theirs);
  if (!is_equal) {
    ReplaceTour(session, theirs.name, &wanted);
    session->Say("The tour '" + theirs.name + "' was updated");
  }
  const std::optional<HubTour> written = ForHub(*session, wanted);
  session->PutTour(TourLink{theirs.name, theirs.revision, written ? ContentOf(*written) : "",
                            session->hub().restoration()});
}

}  // namespace

void PushTours(SyncSession* session, bool may_remove) {
  const std::vector<HubTour> theirs = session->hub().Tours();
  const std::vector<TourLink> links = TourLinks(session, theirs);
  const int problems = session->report().problems;
  const std::vector<Tour> tours = LocalTours(session);
  // A damaged tour is left out there, which does not mean that somebody removed it.
  const bool are_all_known = session->report().problems == problems;
  for (const Tour& tour : tours) {
    try {
      PushTour(session, tour, theirs, TourNamed(links, tour.name), may_remove);
    } catch (const HubUnreachable&) {
      throw;
    } catch (const Error& error) {
      session->SayProblem("The tour '" + tour.name + "' was not saved on the hub: " + error.what());
    }
  }
  for (const TourLink& link : links) {
    const HubTour* on_hub = TourNamed(theirs, link.name);
    if (TourNamed(tours, link.name) != nullptr || on_hub == nullptr || on_hub->removed ||
        !session->options().remove || on_hub->revision != link.revision)
      continue;
    if (!may_remove || !are_all_known) {
      session->SayProblem("The tour '" + link.name +
                          "' was not removed from the hub, because not everything here could be read and "
                          "saved there");
      continue;
    }
    HubTour removed = *on_hub;
    removed.removed = true;
    try {
      session->hub().SaveTour(removed, on_hub->revision);
      session->RemoveTour(link.name);
      session->Say("The tour '" + link.name + "' was removed from the hub");
    } catch (const HubUnreachable&) {
      throw;
    } catch (const Error& error) {
      session->SayProblem("The tour '" + link.name + "' was not removed from the hub: " + error.what());
    }
  }
}

void PullTours(SyncSession* session) {
  const std::vector<HubTour> theirs = session->hub().Tours();
  const std::vector<TourLink> links = TourLinks(session, theirs);
  for (const HubTour& tour : theirs) {
    try {
      PullTour(session, tour, LocalTours(session), theirs, TourNamed(links, tour.name));
    } catch (const HubUnreachable&) {
      throw;
    } catch (const Error& error) {
      session->SayProblem("The tour '" + tour.name + "' was not updated: " + error.what());
    }
  }
}

}  // namespace docent::maps
