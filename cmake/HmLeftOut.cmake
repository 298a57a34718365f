# Left out under the address and undefined behaviour sanitizers: these judge figures over many seeds, long flights or whole walks, for
# minutes there, and run code that other tests of their files run on less.
set(hm_left_out_when_sanitized
  # sim, geometry, io
  WalkCoverage.TheHouseWalkSeesNearlyAllThatAPersonCouldSee
  SceneUp.AtAnyRollItIsRightOrUnknown
  SceneUp.ACameraHeldOnItsSideIsNotTakenForUpright
  # odometry
  TrackerCovariance.IsHonestOverSeeds
  TrackerCovariance.KeyframesAreHonestAboutMotionAndSights
  RowMotion.LateStampsDoNotMatter
  RowMotion.ARollingShutterIsTrackedAndItsTimesAreFound
  Tracker.DroppedFramesDoNotSpoilThePrediction
  TrackerInertia.WrongReadingsDoNoHarm
  TrackerCovariance.GrowsAlongThePathAndIsSymmetric
  Tracker.TheResultDoesNotDependOnWhereOdomIs
  TrackerInertia.AWrongGyroscopeDoesNoHarm
  InertialWindow.PredictsAsWellAsItSays
  WithoutColour/TrackerInTheDark.FollowsTheSurfacesAndFindsItsLandmarksAgain/1
  OdometryRates.*
  InertialTracking.WrongReadingsChangeNothing
  InertialTracking.ADeviceThatIsKnockedLosesItsTrust
  # slam
  CovisibilityMatches.MakeTheMapBetter
  RgbdLoopCloser.RingIsClosed
  LoopSelector.CorridorOfIdenticalDoors
  SlamPipeline.CountsFramesThatItsCapDoesNotLetItKeep
  All/RealCheck.WhatIsOddIsFoundAndEveryInjectedFaultIs/sevenscenes_a
  All/RealCheck.WhatIsOddIsFoundAndEveryInjectedFaultIs/icl_of_kt3
  # laser
  LaserRing.*
  LaserOffice.*
  FreeDirectionSearch.OdometryAlongACorridorKeepsItsLength
  LoopRevisionTest.IsAsGoodAsEveryChoiceOfHypotheses
  # flight
  FailSafesInFlight.EachActsAfterItsTimeOut
  FlightLimits.*
  FlightFaults.*
  FlightRun.PassesADoorThereAndBack
  # calibration, experiments
  RawDisparity.ConstantsAndDepthCameraAreFoundWithoutInfraredPictures
  TinyExperiment.*
  # repeated to compare bits: of threads and runs
  LoopRevisionTest.SameBitsEveryTime
  ScanGraph2D.SameBitsEveryTime
  LiveLaserLoopCloser.GivesTheSameBitsOnAThreadOfItsOwn
  MapFrameOfLoops.AThreadForLoopsChangesNothingThatIsKnownAtTheEnd
  SlamPipeline.TheEndOnMoreThreadsGivesTheSame
  FlightRun.ATraceOfTheCoreReplaysItsMotorCommands
  Tracker.IsDeterministic
  RgbdLoopCloser.SameKeyframesSameBitsAndLiveAgrees
  SlamPipeline.ReadsFramesAgainFromTheCallersOwnSource
  SlamPipeline.ContinuesASavedRunAsIfItHadNotBeenInterrupted
  SlamPipeline.FramesFromACallerGiveWhatARecordingGives
  InertialTracking.ARestoredRunGoesOnWithTheSameBits
  LaserRun.NumbersOfALongRunAreThoseOfAllItsScans
  AlignedReconstruction.TheSameBitsOnOneThreadOrTwoAndWhenResumed
  Reconstruction.StoppedAtEveryFrameAndResumedGivesTheSameBits
  LaserSimulationRecording.HasTheSameBytesForAnyNumberOfThreads
  SimulationRecording.HasTheSameBytesForAnyNumberOfThreads
  Simulation.IsTheSameForEveryRunAndNumberOfThreads
  Reconstruction.ThreadsBudgetsAndSavesDoNotChangeTheResult
  FlightRun.TheSameSeedGivesTheSameBits)
list(JOIN hm_left_out_when_sanitized ":" hm_left_out_when_sanitized)
