// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/word_bag.h"

namespace docent::maps {

// Bags of words of many keyframes, and for each word the keyframes that have it (Sivic and Zisserman 2003):
// a search reads the lists of the words that it asks for and nothing else, the rarest first, and stops where
// more would say little. Scores weigh terms by their frequency in the image and by their rarity among all
// keyframes (Nister and Stewenius 2006), always as of now: adding and removing leaves everything as if only
// what is there had ever been added.
//
// Any thread may call anything. Searches share a lock; whoever adds or removes holds it for one keyframe at a
// time, some microseconds, and goes before searches that begin later.
class InvertedFile {
 public:
  using Slot = std::uint32_t;  // of a keyframe while it is here; given out again afterwards
  static constexpr Slot kNoSlot = 0xFFFFFFFFu;
  struct Owner {
    std::uint64_t map_key = 0;
    engine::KeyFrameId keyframe = engine::kNoId;
  };
  struct Hit {
    Slot slot = kNoSlot;
    Owner owner;
    // Of tf-idf vectors brought to a sum of 1, how much the two share: 1 for the same words in the same
    // proportions, 0 for none in common. tf: how often the image has the word; idf: ln(1 + N / n) for a
    // word that n of N keyframes have.
    double score = 0;
  };
  struct Cost {
    std::size_t words = 0, postings = 0;  // looked at
  };

  InvertedFile();
  ~InvertedFile();

  Slot Add(const engine::WordBag& bag, Owner owner);
  void Remove(Slot slot);
  std::size_t size() const;  // keyframes
  std::size_t postings() const;

  // The `count` keyframes that share most, best first; ties go to the lower slot. What a keyframe shares is
  // first estimated from the rarest words; the best of that are compared by all words.
  std::vector<Hit> Search(const engine::WordBag& wanted, std::size_t count, Cost* cost = nullptr) const;
  // The scores of chosen slots, in their order, by all words.
  std::vector<double> Scores(const engine::WordBag& wanted, std::span<const Slot> slots) const;

 private:
  struct Scratch;
  class Weights;
  // Whoever wants to change something closes the door behind those who are reading.
  class Reading;
  std::vector<Slot> Shortlist(const engine::WordBag& wanted, const Weights& weights, std::size_t count,
                              Cost* cost) const;
  std::unique_ptr<Scratch> TakeScratch() const;
  void GiveBack(std::unique_ptr<Scratch> scratch) const;

  mutable std::mutex door_;
  mutable std::shared_mutex mutex_;  // guards what follows
  // By word: slot << 4 | count - 1, in no order.
  std::vector<std::vector<std::uint32_t>> lists_;
  std::vector<engine::WordBag> bags_;   // by slot
  std::vector<std::uint16_t> lengths_;  // by slot: words, repeated ones counted
  std::vector<Owner> owners_;           // by slot
  std::vector<Slot> free_;
  std::size_t postings_ = 0;

  mutable std::mutex scratch_mutex_;
  mutable std::vector<std::unique_ptr<Scratch>> scratch_;  // all zeros, one for each search at once
};

}  // namespace docent::maps
