namespace hm { void zz_local_stub_evaluation(); void zz_local_stub_evaluation() {} }
