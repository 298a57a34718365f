namespace hm { void zz_local_stub_tsdf(); void zz_local_stub_tsdf() {} }
