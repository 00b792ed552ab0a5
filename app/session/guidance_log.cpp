// SPDX-License-Identifier: Apache-2.0
#include "app/session/guidance_log.h"

#include "app/files/text_file.h"
#include "app/output/run_output.h"

namespace docent::app {

GuidanceLog::GuidanceLog(const std::filesystem::path& folder) : file_(folder / "guidance.csv") {
  file_.Write("timestamp,camera,map,signpost,to,towards,x,y,z,u,v\n");
}

void GuidanceLog::Add(const engine::TrackedFrame& frame, const std::string& map_name, const ShownWay& way) {
  std::string line = FormatSeconds(frame.frame.time) + ',' + std::to_string(frame.frame.camera) + ',' +
                     CsvField(map_name) + ',' + CsvField(way.signpost) + ',' + CsvField(way.to_map) + ',' +
                     (way.follows_direction ? "direction" : "signpost");
  for (const double value : way.towards) line += ',' + FormatNumber(value, 7);
  for (const double value : way.drawn.arrow.tip) line += ',' + FormatNumber(value, 7);
  file_.Write(line + '\n');
}

}  // namespace docent::app
