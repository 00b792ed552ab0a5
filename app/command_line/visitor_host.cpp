// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/visitor_host.h"

#include <utility>

#include "app/script/format_command.h"
#include "app/session/route_text.h"
#include "engine/base/error.h"
#include "maps/library/map_copies.h"

namespace docent::app {

VisitorHost::VisitorHost(const GuideRequest& request, Session* session, std::size_t cameras, Report report)
    : request_(request),
      session_(session),
      report_(std::move(report)),
      strings_(VisitorStringsFor(request.language)),
      visitors_(cameras) {
  if (request.route) {
    route_.emplace(*request.route);
  } else if (request.library != nullptr) {
    for (const auto& [older, newer] : maps::ReplacedByCopies(maps::FindCopies(*request.library)))
      replaced_.insert(older);
  }
  if (request.narrate) {
    narration_.emplace(strings_);
    speech_.emplace(strings_.language);
  }
  if (request.visit_log) visits_.emplace(*request.visit_log, request.tour);
  LeftTour::Times times;
  if (!request.kiosk_code.empty()) {
    times.left = 120;  // As VisitRecorder ends a visit.
    left_tour_.emplace(times, false);
  } else if (route_) {
    // A visitor who chooses by gaze alone has nothing to answer with.
    left_tour_.emplace(times, !request.gaze);
  }
  for (std::size_t i = 0; i < cameras; ++i) Welcome(i);
}

std::vector<std::string> VisitorHost::PlaceNames() const {
  std::vector<std::string> names;
  if (request_.route) {
    for (const RouteStop& stop : request_.route->stops) names.push_back(stop.name);
    return names;
  }
  for (const Session::MapState& map : session_->Maps()) {
    if (map.in_library && !replaced_.contains(map.key)) names.push_back(map.name);
  }
  return names;
}

void VisitorHost::Welcome(std::size_t index) {
  visitors_[index].emplace(session_, PlaceNames(), strings_, route_ ? &*route_ : nullptr, request_.language,
                           request_.gaze);
}

void VisitorHost::WatchForNextVisitor(const ShownFrame& frame) {
  const cv::Mat& image = frame.tracked.frame.image;
  if (!left_tour_ || image.empty()) return;
  if (left_tour_->Update(frame.seconds, image, route_ && route_->is_begun())) {
    const bool is_kiosk = !request_.kiosk_code.empty();
    BeginAnew(frame.tracked.frame.time, is_kiosk ? "the device was left; the next visit begins"
                                                 : "the device was left; the tour begins anew");
  } else if (route_ && route_->HasReturned()) {
    BeginAnew(frame.tracked.frame.time, "back at the first stop after the end; the tour begins anew");
  }
  // What an earlier visitor has opened would hide the question.
  if (left_tour_->is_asking()) visitors_[0]->cards()->Do({GuideVisitor::Step::kClose, {}});
}

void VisitorHost::BeginAnew(Timestamp time, const std::string& why) {
  ++visitors_before_;
  if (left_tour_) left_tour_->Answer();
  if (request_.route) route_.emplace(*request_.route);
  for (std::size_t i = 0; i < visitors_.size(); ++i) Welcome(i);
  if (narration_) narration_.emplace(strings_);
  asked_sounds_.clear();
  if (visits_) visits_->Next();
  report_({time, request_.kiosk_code.empty() ? "tour" : "kiosk", why});
}

void VisitorHost::AddQuestion(ShownFrame* frame) {
  frame->visitors_before = visitors_before_;
  if (!left_tour_ || !left_tour_->is_asking()) return;
  frame->visitor->asks_to_continue = true;
  frame->visitor->sentence = strings_.was_left;
}

void VisitorHost::Guide(std::size_t index, const engine::CameraModel& camera,
                        const std::shared_ptr<ShownFrame>& frame) {
  if (index == 0) WatchForNextVisitor(*frame);
  GuideAgain(index, camera, frame);
  if (index != 0 || !visits_) return;
  // These images belong to no visit: neither to that of the visitor who has left nor to the next one.
  if (left_tour_ && left_tour_->is_between_visits()) return;
  visits_->Add(*frame, route_ ? &*route_ : nullptr);
  ReportProblem(visits_->TakeProblem(), frame->tracked.frame.time);
}

void VisitorHost::GuideAgain(std::size_t index, const engine::CameraModel& camera,
                             const std::shared_ptr<ShownFrame>& frame) {
  const Timestamp time = frame->tracked.frame.time;
  visitors_[index]->Guide(frame, camera);
  AddQuestion(frame.get());
  ReportCards(index, time);
  // A skipped image does not say that what can be read has left the view.
  if (index == 0 && frame->tracked.state != engine::TrackingState::kDropped) Narrate(*frame, camera);
  ReportRoute(time);
}

bool VisitorHost::Lead(const Command& command, const engine::TrackedFrame& frame) {
  const auto* const guide = std::get_if<GuideVisitor>(&command);
  if (guide == nullptr) return false;
  const auto index = static_cast<std::size_t>(frame.frame.camera);
  Use();
  if (visitors_[index]->cards()->Do(*guide)) {
    report_({frame.frame.time, "command", FormatCommand(command)});
    ReportCards(index, frame.frame.time);
    return true;
  }
  if (guide->step == GuideVisitor::Step::kRestart) {
    report_({frame.frame.time, "command", FormatCommand(command)});
    BeginAnew(frame.frame.time, "the visitor begins anew");
    return true;
  }
  if (guide->step == GuideVisitor::Step::kContinue) {
    if (left_tour_) left_tour_->Answer();
    report_({frame.frame.time, "command", FormatCommand(command)});
    return true;
  }
  if (!route_) throw Error("there are no stops; use docent tour --tour NAME to be led along a tour");
  if (guide->step == GuideVisitor::Step::kSkip && !route_->Skip()) throw Error(strings_.no_further_stop);
  if (guide->step == GuideVisitor::Step::kBack && !route_->GoBack()) throw Error(strings_.no_stop_before);
  report_({frame.frame.time, "command", FormatCommand(command)});
  ReportRoute(frame.frame.time);
  return true;
}

void VisitorHost::Use() {
  if (left_tour_) left_tour_->Use();
}

void VisitorHost::Finish() {
  if (visits_) visits_->Finish();
}

void VisitorHost::Narrate(const ShownFrame& frame, const engine::CameraModel& camera) {
  if (!narration_) return;
  Narration::Seen seen{.seconds = frame.seconds, .display = &*frame.visitor, .way = nullptr, .signs = {}};
  if (frame.way) seen.way = &*frame.way;
  if (engine::HasPose(frame.tracked.state) && frame.shown.scene)
    seen.signs = SignsInView(*frame.shown.scene, camera, frame.tracked.camera_from_map, request_.language);
  const Timestamp time = frame.tracked.frame.time;
  for (std::string& text : narration_->Update(seen)) {
    report_({time, "narration", text});
    speech_->Say(std::move(text));
  }
  ReportProblem(speech_->TakeProblem(), time);
}

void VisitorHost::ReportProblem(const std::string& problem, Timestamp time) const {
  if (!problem.empty()) report_({time, "warning", problem});
}

void VisitorHost::ReportCards(std::size_t index, Timestamp time) {
  for (const VisitorCards::Opened& opened : visitors_[index]->cards()->TakeOpened()) {
    report_({time, "card", "'" + opened.entity + "' opened"});
    for (const std::string& sound : opened.sounds) asked_sounds_.emplace_back(opened.map_key, sound);
  }
}

void VisitorHost::ReportRoute(Timestamp time) {
  if (!route_) return;
  for (const RouteEvent& event : route_->TakeEvents()) report_({time, "tour", TextOf(event, *route_)});
}

}  // namespace docent::app
