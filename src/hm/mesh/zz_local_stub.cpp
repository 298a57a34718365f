namespace hm { void zz_local_stub_mesh(); void zz_local_stub_mesh() {} }
