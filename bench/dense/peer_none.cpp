// In place of peer_open3d.cpp where Open3D is not installed.
#include "dense/peer.hpp"

namespace hm::bench {

std::unique_ptr<Peer> make_peer(const PeerOptions&, const PinholeCamera&) { return nullptr; }
bool has_peer() { return false; }
void limit_peer_threads(int) {}

}  // namespace hm::bench
