// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_strings.h"

#include "content/language.h"

namespace docent::app {

namespace {

constexpr VisitorStrings kEnglish = {
    .language = "en",
    .is_right_to_left = false,
    .welcome = "Welcome. Look around slowly, and I will tell you where you are.",
    .no_places = "There are no places to visit here yet.",
    .look_around = "Look around slowly.",
    .go_back_to = "Go back to {}, and look around slowly.",
    .go_to_a_place = "Go to one of these places and look around slowly.",
    .go_to_a_view = "Go to where you see one of these views.",
    .not_recognized = "I don't recognize this place yet. Step back and look around slowly.",
    .resembles = "This resembles {}, but does not match it. Move a little and look again.",
    .only_a_corner = "Only one corner of the image shows {}. Turn so that more of it is visible.",
    .either_of_two = "This could be either of two places in {}. Move so that more is visible.",
    .this_or_that = "This could be {} or {}. Move so that more is visible.",
    .probably = "Probably {}; hold still",
    .more_slowly = "Move more slowly.",
    .little_detail = "Little detail is in view: turn towards the exhibit.",
    .left_the_map = "You have left the known area: look back.",
    .look_back = "Look back at a place you have seen before.",
    .other_camera = "Point this camera at what the other camera sees.",
    .to = "To {}",
    .to_through = "To {}, through {}",
    .at_left = "On the left: {}",
    .at_right = "On the right: {}",
    .ahead = "Straight ahead: {}",
    .behind = "Behind you: {}",
    .first_stop = "{}. First: {}",
    .one_stop = "1 stop",
    .stops = "{} stops",
    .about_minutes = "{}, about {} minutes",
    .stop_and_next = "Stop {} of {}. Next: {}",
    .next = "Next: {}, {} of {}",
    .back_to = "Back to {}, {} of {}",
    .saw_all = "The tour ends here. You saw all {} stops.",
    .saw_only = "The tour ends here. You saw its only stop.",
    .saw_some = "The tour ends here. You saw {} of {} stops.",
    .numbered_stop = "{}. {}",
    .seen_stop = "{}. {} (seen)",
    .skipped_stop = "{}. {} (skipped)",
    .next_stop = "{}. {} (next)",
    .no_further_stop = "There are no more stops.",
    .no_stop_before = "There is no stop before this one.",
    .open_a_card = "Touch what the corners on the screen mark, or press the button, to learn more.",
    .look_to_open = "Look at what the corners on the screen mark to learn more.",
    .nothing_to_open = "There is nothing to open here.",
    .more_pages = "Page {} of {}. Press for more.",
    .close_card = "Press to close.",
    .pages_turn = "Page {} of {}. It turns by itself.",
    .look_away = "Look away to close.",
    .other_is_at = "Other camera: {}",
    .other_is_lost = "Other camera: looking for its place",
    .cameras_apart = "The other camera does not recognize this place. Are you wearing both cameras?",
    .device_is_slow = "This device is busy, and the image moves less smoothly.",
    .menu_skip = "Skip the next stop",
    .menu_back = "Back to the previous stop",
    .menu_stops = "All stops",
    .menu_anew = "Start again",
    .menu_close = "Close",
    .was_left = "This tour was started a while ago. Do you want to continue it?",
    .choose_continue = "Continue this tour",
    .choose_restart = "Start the tour again",
};

constexpr VisitorStrings kGerman = {
    .language = "de",
    .is_right_to_left = false,
    .welcome = "Willkommen. Sehen Sie sich langsam um, und ich sage Ihnen, wo Sie sind.",
    .no_places = "Hier gibt es noch keine Orte, die Sie besuchen können.",
    .look_around = "Sehen Sie sich langsam um.",
    .go_back_to = "Gehen Sie zurück zu {}, und sehen Sie sich langsam um.",
    .go_to_a_place = "Gehen Sie zu einem dieser Orte, und sehen Sie sich langsam um.",
    .go_to_a_view = "Gehen Sie dorthin, wo Sie eines dieser Bilder sehen.",
    .not_recognized = "Ich erkenne diesen Ort noch nicht. Treten Sie zurück, und sehen Sie sich langsam um.",
    .resembles =
        "Das sieht aus wie {}, stimmt aber nicht überein. Bewegen Sie sich ein wenig, und sehen Sie noch "
        "einmal hin.",
    .only_a_corner = "Nur eine Ecke des Bildes zeigt {}. Drehen Sie sich, bis mehr davon zu sehen ist.",
    .either_of_two = "Das könnte jede von zwei Stellen in {} sein. Bewegen Sie sich, bis mehr zu sehen ist.",
    .this_or_that = "Das könnte {} oder {} sein. Bewegen Sie sich, bis mehr zu sehen ist.",
    .probably = "Wahrscheinlich {}; bitte ruhig halten",
    .more_slowly = "Bewegen Sie sich langsamer.",
    .little_detail = "Hier ist wenig zu erkennen: Drehen Sie sich zum Ausstellungsstück.",
    .left_the_map = "Sie haben den bekannten Bereich verlassen: Sehen Sie zurück.",
    .look_back = "Sehen Sie dorthin zurück, wo Sie schon waren.",
    .other_camera = "Richten Sie diese Kamera auf das, was die andere Kamera sieht.",
    .to = "Zu {}",
    .to_through = "Zu {}, über {}",
    .at_left = "Links: {}",
    .at_right = "Rechts: {}",
    .ahead = "Geradeaus: {}",
    .behind = "Hinter Ihnen: {}",
    .first_stop = "{}. Zuerst: {}",
    .one_stop = "1 Station",
    .stops = "{} Stationen",
    .about_minutes = "{}, etwa {} Minuten",
    .stop_and_next = "Station {} von {}. Als Nächstes: {}",
    .next = "Als Nächstes: {}, {} von {}",
    .back_to = "Zurück zu {}, {} von {}",
    .saw_all = "Die Führung endet hier. Sie haben alle {} Stationen gesehen.",
    .saw_only = "Die Führung endet hier. Sie haben die einzige Station gesehen.",
    .saw_some = "Die Führung endet hier. Sie haben {} von {} Stationen gesehen.",
    .numbered_stop = "{}. {}",
    .seen_stop = "{}. {} (gesehen)",
    .skipped_stop = "{}. {} (ausgelassen)",
    .next_stop = "{}. {} (als Nächstes)",
    .no_further_stop = "Es gibt keine weitere Station.",
    .no_stop_before = "Vor dieser Station gibt es keine andere.",
    .open_a_card =
        "Berühren Sie auf dem Bildschirm, was die Ecken markieren, oder drücken Sie die Taste, um mehr zu "
        "erfahren.",
    .look_to_open = "Sehen Sie an, was die Ecken auf dem Bildschirm markieren, um mehr zu erfahren.",
    .nothing_to_open = "Hier lässt sich nichts öffnen.",
    .more_pages = "Seite {} von {}. Drücken Sie für mehr.",
    .close_card = "Zum Schließen drücken.",
    .pages_turn = "Seite {} von {}. Sie blättert von selbst weiter.",
    .look_away = "Zum Schließen wegsehen.",
    .other_is_at = "Andere Kamera: {}",
    .other_is_lost = "Andere Kamera: sucht ihren Ort",
    .cameras_apart = "Die andere Kamera wird hier nicht erkannt. Tragen Sie beide Kameras?",
    .device_is_slow = "Dieses Gerät ist ausgelastet; das Bild bewegt sich weniger flüssig.",
    .menu_skip = "Die nächste Station auslassen",
    .menu_back = "Zurück zur Station davor",
    .menu_stops = "Alle Stationen",
    .menu_anew = "Neu beginnen",
    .menu_close = "Schließen",
    .was_left = "Diese Führung wurde vor einer Weile begonnen. Möchten Sie sie fortsetzen?",
    .choose_continue = "Diese Führung fortsetzen",
    .choose_restart = "Die Führung neu beginnen",
};

constexpr VisitorStrings kSpanish = {
    .language = "es",
    .is_right_to_left = false,
    .welcome = "Bienvenido. Mire despacio a su alrededor y le diré dónde está.",
    .no_places = "Todavía no hay lugares que visitar aquí.",
    .look_around = "Mire despacio a su alrededor.",
    .go_back_to = "Vuelva a {} y mire despacio a su alrededor.",
    .go_to_a_place = "Vaya a uno de estos lugares y mire despacio a su alrededor.",
    .go_to_a_view = "Vaya a donde vea una de estas imágenes.",
    .not_recognized = "Todavía no reconozco este lugar. Dé un paso atrás y mire despacio a su alrededor.",
    .resembles = "Esto se parece a {}, pero no coincide. Muévase un poco y vuelva a mirar.",
    .only_a_corner = "Solo una esquina de la imagen muestra {}. Gire hasta que se vea más.",
    .either_of_two = "Esto podría ser cualquiera de dos sitios de {}. Muévase hasta que se vea más.",
    .this_or_that = "Esto podría ser {} o {}. Muévase hasta que se vea más.",
    .probably = "Probablemente {}; no se mueva",
    .more_slowly = "Muévase más despacio.",
    .little_detail = "Aquí se distingue poco: gire hacia la pieza expuesta.",
    .left_the_map = "Ha salido de la zona conocida: mire hacia atrás.",
    .look_back = "Mire hacia un lugar que ya haya visto.",
    .other_camera = "Apunte esta cámara a lo que ve la otra cámara.",
    .to = "Hacia {}",
    .to_through = "Hacia {}, por {}",
    .at_left = "A la izquierda: {}",
    .at_right = "A la derecha: {}",
    .ahead = "Todo recto: {}",
    .behind = "Detrás de usted: {}",
    .first_stop = "{}. Primero: {}",
    .one_stop = "1 parada",
    .stops = "{} paradas",
    .about_minutes = "{}, unos {} minutos",
    .stop_and_next = "Parada {} de {}. Siguiente: {}",
    .next = "Siguiente: {}, {} de {}",
    .back_to = "De vuelta a {}, {} de {}",
    .saw_all = "El recorrido termina aquí. Ha visto las {} paradas.",
    .saw_only = "El recorrido termina aquí. Ha visto la única parada.",
    .saw_some = "El recorrido termina aquí. Ha visto {} de {} paradas.",
    .numbered_stop = "{}. {}",
    .seen_stop = "{}. {} (vista)",
    .skipped_stop = "{}. {} (omitida)",
    .next_stop = "{}. {} (siguiente)",
    .no_further_stop = "No hay más paradas.",
    .no_stop_before = "No hay ninguna parada antes de esta.",
    .open_a_card = "Toque en la pantalla lo que marcan las esquinas, o pulse el botón, para saber más.",
    .look_to_open = "Mire lo que marcan las esquinas de la pantalla para saber más.",
    .nothing_to_open = "Aquí no hay nada que abrir.",
    .more_pages = "Página {} de {}. Pulse para ver más.",
    .close_card = "Pulse para cerrar.",
    .pages_turn = "Página {} de {}. Pasa sola a la siguiente.",
    .look_away = "Mire a otro lado para cerrar.",
    .other_is_at = "Otra cámara: {}",
    .other_is_lost = "Otra cámara: busca su lugar",
    .cameras_apart = "La otra cámara no se reconoce aquí. ¿Lleva usted las dos cámaras?",
    .device_is_slow = "Este dispositivo está ocupado, y la imagen se mueve con menos fluidez.",
    .menu_skip = "Omitir la siguiente parada",
    .menu_back = "Volver a la parada anterior",
    .menu_stops = "Todas las paradas",
    .menu_anew = "Empezar de nuevo",
    .menu_close = "Cerrar",
    .was_left = "Este recorrido se empezó hace un rato. ¿Desea continuarlo?",
    .choose_continue = "Continuar este recorrido",
    .choose_restart = "Empezar el recorrido de nuevo",
};

constexpr VisitorStrings kArabic = {
    .language = "ar",
    .is_right_to_left = true,
    .welcome = "مرحبًا بك. انظر حولك ببطء وسأخبرك أين أنت.",
    .no_places = "لا توجد هنا أماكن للزيارة بعد.",
    .look_around = "انظر حولك ببطء.",
    .go_back_to = "عد إلى {} وانظر حولك ببطء.",
    .go_to_a_place = "اذهب إلى أحد هذه الأماكن وانظر حولك ببطء.",
    .go_to_a_view = "اذهب إلى حيث ترى إحدى هذه الصور.",
    .not_recognized = "لم أتعرف على هذا المكان بعد. تراجع خطوة إلى الوراء وانظر حولك ببطء.",
    .resembles = "يشبه هذا {} لكنه لا يطابقه. تحرك قليلًا وانظر مرة أخرى.",
    .only_a_corner = "لا تُظهر الصورة {} إلا في إحدى زواياها. استدر حتى يظهر المزيد.",
    .either_of_two = "قد يكون هذا أحد موضعين في {}. تحرك حتى يظهر المزيد.",
    .this_or_that = "قد يكون هذا {} أو {}. تحرك حتى يظهر المزيد.",
    .probably = "على الأرجح {}؛ ابقَ ثابتًا",
    .more_slowly = "تحرك ببطء أكثر.",
    .little_detail = "لا يظهر هنا ما يكفي من التفاصيل: استدر نحو القطعة المعروضة.",
    .left_the_map = "لقد غادرت المنطقة المعروفة: انظر خلفك.",
    .look_back = "انظر إلى مكان رأيته من قبل.",
    .other_camera = "وجّه هذه الكاميرا إلى ما تراه الكاميرا الأخرى.",
    .to = "إلى {}",
    .to_through = "إلى {} عبر {}",
    .at_left = "على اليسار: {}",
    .at_right = "على اليمين: {}",
    .ahead = "إلى الأمام مباشرة: {}",
    .behind = "خلفك: {}",
    .first_stop = "{}. أولًا: {}",
    .one_stop = "محطة واحدة",
    .stops = "عدد المحطات: {}",
    .about_minutes = "{}، والمدة بالدقائق نحو {}",
    .stop_and_next = "المحطة {} من {}. التالية: {}",
    .next = "التالية: {}، {} من {}",
    .back_to = "العودة إلى {}، {} من {}",
    .saw_all = "تنتهي الجولة هنا. لقد رأيت جميع المحطات، وعددها {}.",
    .saw_only = "تنتهي الجولة هنا. لقد رأيت المحطة الوحيدة.",
    .saw_some = "تنتهي الجولة هنا. المحطات التي رأيتها: {} من {}.",
    .numbered_stop = "{}. {}",
    .seen_stop = "{}. {} (شوهدت)",
    .skipped_stop = "{}. {} (تم تخطيها)",
    .next_stop = "{}. {} (التالية)",
    .no_further_stop = "لا توجد محطات أخرى.",
    .no_stop_before = "لا توجد محطة قبل هذه.",
    .open_a_card = "المس ما له إطار أو اضغط الزر لمعرفة المزيد.",
    .look_to_open = "انظر إلى ما له إطار لمعرفة المزيد.",
    .nothing_to_open = "لا يوجد هنا ما يمكن فتحه.",
    .more_pages = "الصفحة {} من {}. اضغط للمزيد.",
    .close_card = "اضغط للإغلاق.",
    .pages_turn = "الصفحة {} من {}. تُقلب الصفحات تلقائيًا.",
    .look_away = "انظر بعيدًا للإغلاق.",
    .other_is_at = "الكاميرا الأخرى: {}",
    .other_is_lost = "الكاميرا الأخرى: تبحث عن مكانها",
    .cameras_apart = "لا يتم التعرف على الكاميرا الأخرى هنا. هل تحمل الكاميرتين معك؟",
    .device_is_slow = "هذا الجهاز مشغول، لذا تتحرك الصورة بسلاسة أقل.",
    .menu_skip = "تخطي المحطة التالية",
    .menu_back = "العودة إلى المحطة السابقة",
    .menu_stops = "جميع المحطات",
    .menu_anew = "البدء من جديد",
    .menu_close = "إغلاق",
    .was_left = "بدأت هذه الجولة منذ فترة. هل تريد متابعتها؟",
    .choose_continue = "متابعة هذه الجولة",
    .choose_restart = "بدء الجولة من جديد",
};

// Of Unicode's bidirectional algorithm (UAX #9): what stands between these marks has the direction of its
// first letter, and does not change that of the text around it.
constexpr std::string_view kFirstStrongIsolate = "\u2068", kPopDirectionalIsolate = "\u2069";
// A text that begins with this mark is set from right to left, also where its first word is a Latin one.
constexpr std::string_view kRightToLeftMark = "\u200f";

}  // namespace

const VisitorStrings& VisitorStringsFor(const std::string& language) {
  static const content::Translations tags = {{"de", "de"}, {"es", "es"}, {"ar", "ar"}};
  static const std::string english = "en";
  const std::string& tag = content::TextFor(language, english, tags);
  for (const VisitorStrings* strings : {&kGerman, &kSpanish, &kArabic}) {
    if (tag == strings->language) return *strings;
  }
  return kEnglish;
}

std::string Filled(const VisitorStrings& strings, std::string_view text,
                   std::initializer_list<std::string> values) {
  constexpr std::string_view kBraces = "{}";
  const bool isolates = strings.is_right_to_left;
  std::string filled(isolates ? kRightToLeftMark : std::string_view());
  for (const std::string& value : values) {
    const std::size_t braces = text.find(kBraces);
    if (braces == std::string_view::npos) break;
    filled += text.substr(0, braces);
    if (isolates) filled += kFirstStrongIsolate;
    filled += value;
    if (isolates) filled += kPopDirectionalIsolate;
    text.remove_prefix(braces + kBraces.size());
  }
  return filled += text;
}

}  // namespace docent::app
